"""What sensors.yaml may hold: one typed entry per sensor."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from fv_common.errors import told_as
from fv_common.schema import (
    Config,
    NotNegative,
    Range,
    Seed,
    Share,
    from_mapping,
    require_mapping,
    require_ros_name,
)
from hubo_description.errors import RobotDescriptionError

Rate = Annotated[float, Range(0.01, 1000)]
Pixels = Annotated[int, Range(2, 8192)]
FieldOfView = Annotated[float, Range(5, 179, unit="deg")]  # less: radians


def _check_ranges(sensor: DepthCamera | Lidar) -> None:
    near, far = sensor.min_range_m, sensor.max_range_m
    if not 0.0 <= near < far:
        raise ValueError(f"needs 0 <= min_range_m < max_range_m, got {near} and {far}")


@dataclass(frozen=True)
class AxialNoise(Config):
    """Gaussian noise of the depth: sigma(z) = sigma_base_m + sigma_quadratic_per_m (z - offset_m)^2, z in m.

    Source: Nguyen, Izadi, Lovell, 3DIMPVT 2012, axial part.
    """

    enabled: bool = True
    sigma_base_m: NotNegative = 0.0012
    sigma_quadratic_per_m: NotNegative = 0.0019
    offset_m: float = 0.4


@dataclass(frozen=True)
class LateralNoise(Config):
    """Gaussian jitter of the image coordinates, seen where the depth jumps."""

    enabled: bool = False
    sigma_px: Annotated[float, Range(0, 10)] = 0.8


@dataclass(frozen=True)
class Grazing(Config):
    """No return where ray and surface normal enclose more than max_incidence_deg."""

    enabled: bool = False
    max_incidence_deg: Annotated[float, Range(1, 90)] = 80.0


@dataclass(frozen=True)
class MixedPixels(Config):
    """Share of the pixels at a depth jump that lie between foreground and background."""

    enabled: bool = False
    share: Share = 0.3


@dataclass(frozen=True)
class DepthNoise(Config):
    """Defects of a depth image, each with its switch, all drawn from one seed."""

    seed: Seed = 0
    axial: AxialNoise = field(default_factory=AxialNoise)
    lateral: LateralNoise = field(default_factory=LateralNoise)
    grazing: Grazing = field(default_factory=Grazing)
    mixed_pixels: MixedPixels = field(default_factory=MixedPixels)


@dataclass(frozen=True)
class DepthCamera(Config):
    """A depth and colour camera with one pinhole for both."""

    type: str
    link: str
    optical_frame: str  # x right, y down, z forward
    topic: str  # prefix
    width: Pixels
    height: Pixels
    horizontal_fov_deg: FieldOfView  # full angle
    vertical_fov_deg: FieldOfView  # full angle
    min_range_m: float  # along the optical axis
    max_range_m: Annotated[float, Range(0.01, 100, unit="m")]  # more: millimetres; along the optical axis
    rate_hz: Rate  # simulated time
    noise: DepthNoise = field(default_factory=DepthNoise)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_ranges(self)

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return (self.link, self.optical_frame)


@dataclass(frozen=True)
class Lidar(Config):
    """Rays over azimuth about z of ``frame``, from -fov/2 to +fov/2 (x is 0), in layers of elevation; 1 layer: planar.

    A planar one is published as LaserScan, one with layers as PointCloud2 (x, y, z; one row a layer, lowest first).
    """

    type: str
    link: str  # that carries it
    frame: str  # a link; x forward, z up the axis of rotation
    topic: str
    samples: Annotated[int, Range(1, 100_000)]  # rays a layer; a full circle does not repeat its first ray
    min_range_m: float
    max_range_m: float
    layers: Annotated[int, Range(1, 1024)] = 1
    horizontal_fov_deg: Annotated[float, Range(0, 360)] = 360.0  # full angle
    vertical_fov_deg: Annotated[float, Range(0, 180)] = 0.0  # full angle; 0 for one layer
    rate_hz: Rate = 10.0  # simulated time
    sigma_m: NotNegative = 0.0  # Gaussian noise of the range
    seed: Seed = 0  # of the noise

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_ranges(self)

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return (self.link, self.frame)


@dataclass(frozen=True)
class Imu(Config):
    """Angular velocity and specific force (at rest 9.81 m/s^2 upwards) of a link, in the link's frame."""

    type: str
    link: str
    topic: str
    rate_hz: Rate = 100.0  # simulated time
    sigma_rad_s: NotNegative = 0.0  # Gaussian noise of each axis
    sigma_m_s2: NotNegative = 0.0
    seed: Seed = 0  # of the noise

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return (self.link,)


@dataclass(frozen=True)
class ForceTorque(Config):
    """Force and torque that a joint transmits onto its child link, in the child link's frame; any joint, fixed too."""

    type: str
    joint: str
    topic: str
    rate_hz: Rate = 100.0  # simulated time
    sigma_n: NotNegative = 0.0  # Gaussian noise of each axis
    sigma_nm: NotNegative = 0.0
    seed: Seed = 0  # of the noise

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return ()


Sensor = DepthCamera | Lidar | Imu | ForceTorque
SENSOR_TYPES: dict[str, type[Sensor]] = {
    "depth_camera": DepthCamera,
    "lidar": Lidar,
    "imu": Imu,
    "force_torque": ForceTorque,
}


@told_as(RobotDescriptionError)
def parse_sensors(data: object, where: str = "sensors.yaml") -> dict[str, Sensor]:
    """Return the sensors by name; an empty mapping is a robot without sensors.

    :raises RobotDescriptionError: unknown type or key, missing key, value out of range.
    """
    sensors = {}
    for name, entry in require_mapping(data, where).items():
        kind = require_mapping(entry, f"{where}: {name}").get("type")
        if kind not in SENSOR_TYPES:
            raise RobotDescriptionError(
                f"{where}: {name}: unknown type {kind!r}; valid types: {', '.join(SENSOR_TYPES)}"
            )
        sensors[name] = from_mapping(SENSOR_TYPES[kind], entry, f"{where}: {name}")
    topics = [sensor.topic.strip("/") for sensor in sensors.values()]
    for name, topic in zip(sensors, topics, strict=True):
        require_ros_name(topic, f"{where}: {name}: topic")
        if topics.count(topic) > 1:
            raise RobotDescriptionError(f"{where}: {name}: topic '{topic}' is another sensor's too")
    return sensors
