"""What a robot says of itself beside a snapshot: battery, link loss, quality of the image."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for name in ("battery", "link_loss", "image_quality"):
        op.add_column("snapshots", sa.Column(name, sa.Float(), nullable=True))


def downgrade() -> None:
    for name in ("battery", "link_loss", "image_quality"):
        op.drop_column("snapshots", name)
