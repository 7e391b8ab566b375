"""How a mosaic lies on its layout is kept with the sigma of every ring: what was measured without is measured anew."""

from __future__ import annotations

from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("DELETE FROM registrations")


def downgrade() -> None:
    op.execute("DELETE FROM registrations")
