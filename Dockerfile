# Two steps: build the complete wheel with Node at hand, then run it from a slim image as an ordinary user.
FROM node:22-bookworm-slim AS frontend
WORKDIR /src/frontend
COPY frontend/package.json frontend/package-lock.json frontend/.npmrc ./
RUN npm ci --omit=dev

FROM python:3.11-slim-bookworm AS wheel
WORKDIR /src
RUN pip install --no-cache-dir hatchling
COPY . .
COPY --from=frontend /src/frontend/node_modules frontend/node_modules
RUN python -m hatchling build -t wheel

FROM python:3.11-slim-bookworm
ENV OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 PONDWATCH_DATA=/data PONDWATCH_HOST=0.0.0.0 PONDWATCH_PORT=8000
COPY requirements.lock /tmp/
RUN pip install --no-cache-dir --requirement /tmp/requirements.lock
COPY --from=wheel /src/dist/*.whl /tmp/
RUN pip install --no-cache-dir --no-deps /tmp/*.whl && rm /tmp/*.whl /tmp/requirements.lock \
    && useradd --system --uid 10001 pondwatch && install -d -o pondwatch /data
USER pondwatch
WORKDIR /data
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=10s --start-period=20s CMD ["python", "-c", \
    "import os, urllib.request as u; u.urlopen(f'http://127.0.0.1:{os.environ[\"PONDWATCH_PORT\"]}/readyz', timeout=3)"]
ENTRYPOINT ["pondwatch"]
CMD ["serve"]
