"""What sensors.yaml may hold: one typed entry per sensor."""

from __future__ import annotations

from dataclasses import dataclass, field

from hubo_description.errors import RobotDescriptionError
from hubo_description.schema import from_mapping, require_mapping, require_ros_name


def _check_ranges(min_range_m: float, max_range_m: float, rate_hz: float) -> None:
    if not 0.0 <= min_range_m < max_range_m:
        raise ValueError(f"needs 0 <= min_range_m < max_range_m, got {min_range_m} and {max_range_m}")
    _check_rate(rate_hz)


def _check_rate(rate_hz: float) -> None:
    _check_interval("rate_hz", rate_hz, 0.01, 1000.0)


def _check_noise(seed: int, **sigmas: float) -> None:
    if seed < 0:
        raise ValueError(f"seed must not be negative, got {seed}")
    for name, sigma in sigmas.items():
        if sigma < 0.0:
            raise ValueError(f"{name} must not be negative, got {sigma:g}")


def _check_interval(name: str, value: float, lower: float, upper: float) -> None:
    if not lower <= value <= upper:
        raise ValueError(f"{name} must lie in {lower:g}..{upper:g}, got {value:g}")


@dataclass(frozen=True)
class AxialNoise:
    """Gaussian noise of the depth: sigma(z) = sigma_base_m + sigma_quadratic_per_m (z - offset_m)^2, z in m.

    Source: Nguyen, Izadi, Lovell, 3DIMPVT 2012, axial part.
    """

    enabled: bool = True
    sigma_base_m: float = 0.0012
    sigma_quadratic_per_m: float = 0.0019
    offset_m: float = 0.4

    def __post_init__(self) -> None:
        for name in ("sigma_base_m", "sigma_quadratic_per_m"):
            if getattr(self, name) < 0.0:
                raise ValueError(f"{name} must not be negative, got {getattr(self, name):g}")


@dataclass(frozen=True)
class LateralNoise:
    """Gaussian jitter of the image coordinates, seen where the depth jumps."""

    enabled: bool = False
    sigma_px: float = 0.8

    def __post_init__(self) -> None:
        _check_interval("sigma_px", self.sigma_px, 0.0, 10.0)


@dataclass(frozen=True)
class Grazing:
    """No return where ray and surface normal enclose more than max_incidence_deg."""

    enabled: bool = False
    max_incidence_deg: float = 80.0

    def __post_init__(self) -> None:
        _check_interval("max_incidence_deg", self.max_incidence_deg, 1.0, 90.0)


@dataclass(frozen=True)
class MixedPixels:
    """Share of the pixels at a depth jump that lie between foreground and background."""

    enabled: bool = False
    share: float = 0.3

    def __post_init__(self) -> None:
        _check_interval("share", self.share, 0.0, 1.0)


@dataclass(frozen=True)
class DepthNoise:
    """Defects of a depth image, each with its switch, all drawn from one seed."""

    seed: int = 0
    axial: AxialNoise = field(default_factory=AxialNoise)
    lateral: LateralNoise = field(default_factory=LateralNoise)
    grazing: Grazing = field(default_factory=Grazing)
    mixed_pixels: MixedPixels = field(default_factory=MixedPixels)

    def __post_init__(self) -> None:
        _check_noise(self.seed)


@dataclass(frozen=True)
class DepthCamera:
    """A depth and colour camera with one pinhole for both."""

    type: str
    link: str
    optical_frame: str  # x right, y down, z forward
    topic: str  # prefix
    width: int  # pixels
    height: int  # pixels
    horizontal_fov_deg: float  # full angle
    vertical_fov_deg: float  # full angle
    min_range_m: float  # along the optical axis
    max_range_m: float  # along the optical axis
    rate_hz: float  # simulated time
    noise: DepthNoise = field(default_factory=DepthNoise)

    def __post_init__(self) -> None:
        _check_interval("horizontal_fov_deg", self.horizontal_fov_deg, 5.0, 179.0)  # less: radians
        _check_interval("vertical_fov_deg", self.vertical_fov_deg, 5.0, 179.0)
        _check_interval("max_range_m", self.max_range_m, 0.01, 100.0)  # more: millimetres
        _check_interval("width", self.width, 2, 8192)
        _check_interval("height", self.height, 2, 8192)
        _check_ranges(self.min_range_m, self.max_range_m, self.rate_hz)

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return (self.link, self.optical_frame)


@dataclass(frozen=True)
class Lidar:
    """Rays over azimuth about z of ``frame``, from -fov/2 to +fov/2 (x is 0), in layers of elevation; 1 layer: planar.

    A planar one is published as LaserScan, one with layers as PointCloud2 (x, y, z; one row a layer, lowest first).
    """

    type: str
    link: str  # that carries it
    frame: str  # a link; x forward, z up the axis of rotation
    topic: str
    samples: int  # rays a layer; a full circle does not repeat its first ray
    min_range_m: float
    max_range_m: float
    layers: int = 1
    horizontal_fov_deg: float = 360.0  # full angle
    vertical_fov_deg: float = 0.0  # full angle; 0 for one layer
    rate_hz: float = 10.0  # simulated time
    sigma_m: float = 0.0  # Gaussian noise of the range
    seed: int = 0  # of the noise

    def __post_init__(self) -> None:
        _check_interval("samples", self.samples, 1, 100_000)
        _check_interval("layers", self.layers, 1, 1024)
        _check_interval("horizontal_fov_deg", self.horizontal_fov_deg, 0.0, 360.0)
        _check_interval("vertical_fov_deg", self.vertical_fov_deg, 0.0, 180.0)
        _check_ranges(self.min_range_m, self.max_range_m, self.rate_hz)
        _check_noise(self.seed, sigma_m=self.sigma_m)

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return (self.link, self.frame)


@dataclass(frozen=True)
class Imu:
    """Angular velocity and specific force (at rest 9.81 m/s^2 upwards) of a link, in the link's frame."""

    type: str
    link: str
    topic: str
    rate_hz: float = 100.0  # simulated time
    sigma_rad_s: float = 0.0  # Gaussian noise of each axis
    sigma_m_s2: float = 0.0
    seed: int = 0  # of the noise

    def __post_init__(self) -> None:
        _check_rate(self.rate_hz)
        _check_noise(self.seed, sigma_rad_s=self.sigma_rad_s, sigma_m_s2=self.sigma_m_s2)

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the robot that it names."""
        return (self.link,)


@dataclass(frozen=True)
class ForceTorque:
    """Force and torque that a joint transmits onto its child link, in the child link's frame; any joint, fixed too."""

    type: str
    joint: str
    topic: str
    rate_hz: float = 100.0  # simulated time
    sigma_n: float = 0.0  # Gaussian noise of each axis
    sigma_nm: float = 0.0
    seed: int = 0  # of the noise

    def __post_init__(self) -> None:
        _check_rate(self.rate_hz)
        _check_noise(self.seed, sigma_n=self.sigma_n, sigma_nm=self.sigma_nm)

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
