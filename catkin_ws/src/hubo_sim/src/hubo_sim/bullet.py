"""pybullet, imported without the line that it prints on import."""

from fv_common.native_output import native_output_hidden

with native_output_hidden():
    import pybullet
    import pybullet_data
    from pybullet_utils.bullet_client import BulletClient

__all__ = ["BulletClient", "pybullet", "pybullet_data"]
