//! `[sensors]` of a scenario: a real part by its name, or parameters of one's own.

use ctrl_core::estimator::{
    BarometerBias, EstimatorConfig, FaultLimits, InertialNoise, InitialDeviation, SourceConfig,
};
use serde::{Deserialize, Serialize};

use super::barometer::BarometerParameters;
use super::capture::CaptureParameters;
use super::fault::SensorFault;
use super::flow::FlowParameters;
use super::gnss::GnssParameters;
use super::imu::ImuParameters;
use super::magnetometer::MagnetometerParameters;
use super::rangefinder::RangefinderParameters;
use super::vibration::VibrationParameters;

/// Inertial measurement unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ImuChoice {
    /// Bosch BMI088.
    #[serde(rename = "bmi088")]
    Bmi088,
    /// TDK ICM-42688-P.
    #[serde(rename = "icm-42688-p")]
    Icm42688P,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(ImuParameters),
}

/// Barometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum BarometerChoice {
    /// Bosch BMP388.
    #[serde(rename = "bmp388")]
    Bmp388,
    /// The same with an offset and a drift.
    #[serde(rename = "bmp388-drifting")]
    Bmp388Drifting,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(BarometerParameters),
}

/// Magnetometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum MagnetometerChoice {
    /// ST LIS3MDL.
    #[serde(rename = "lis3mdl")]
    Lis3Mdl,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(MagnetometerParameters),
}

/// GNSS receiver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GnssChoice {
    /// u-blox NEO-M9N.
    #[serde(rename = "m9n")]
    M9N,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(GnssParameters),
}

/// Motion capture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum CaptureChoice {
    /// A system like Vicon's.
    #[serde(rename = "vicon")]
    Vicon,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(CaptureParameters),
}

/// Rangefinder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum RangefinderChoice {
    /// ST VL53L1X.
    #[serde(rename = "vl53l1x")]
    Vl53L1X,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(RangefinderParameters),
}

/// Optical flow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum FlowChoice {
    /// PixArt PMW3901.
    #[serde(rename = "pmw3901")]
    Pmw3901,
    /// Parameters of one's own.
    #[serde(rename = "custom")]
    Custom(FlowParameters),
}

/// Sensors aboard and around; at least the inertial ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorsConfig {
    /// Inertial measurement unit.
    pub imu: ImuChoice,
    /// Barometer, if there is one.
    pub barometer: Option<BarometerChoice>,
    /// Magnetometer, if there is one.
    pub magnetometer: Option<MagnetometerChoice>,
    /// GNSS receiver, if there is one.
    pub gnss: Option<GnssChoice>,
    /// Motion capture, if there is one.
    pub capture: Option<CaptureChoice>,
    /// Rangefinder, if there is one.
    pub rangefinder: Option<RangefinderChoice>,
    /// Optical flow, if there is any.
    pub flow: Option<FlowChoice>,
    /// Vibration of the frame, if any.
    pub vibration: Option<VibrationParameters>,
    /// Faults in flight.
    #[serde(default)]
    pub faults: Vec<SensorFault>,
}

impl SensorsConfig {
    /// Parameters of the inertial measurement unit.
    #[must_use]
    pub fn imu(&self) -> ImuParameters {
        match self.imu {
            ImuChoice::Bmi088 => ImuParameters::BMI088,
            ImuChoice::Icm42688P => ImuParameters::ICM_42688_P,
            ImuChoice::Custom(parameters) => parameters,
        }
    }

    /// Parameters of the barometer.
    #[must_use]
    pub fn barometer(&self) -> Option<BarometerParameters> {
        self.barometer.map(|choice| match choice {
            BarometerChoice::Bmp388 => BarometerParameters::BMP388,
            BarometerChoice::Bmp388Drifting => BarometerParameters::BMP388_DRIFTING,
            BarometerChoice::Custom(parameters) => parameters,
        })
    }

    /// Parameters of the magnetometer.
    #[must_use]
    pub fn magnetometer(&self) -> Option<MagnetometerParameters> {
        self.magnetometer.map(|choice| match choice {
            MagnetometerChoice::Lis3Mdl => MagnetometerParameters::LIS3MDL,
            MagnetometerChoice::Custom(parameters) => parameters,
        })
    }

    /// Parameters of the GNSS receiver.
    #[must_use]
    pub fn gnss(&self) -> Option<GnssParameters> {
        self.gnss.map(|choice| match choice {
            GnssChoice::M9N => GnssParameters::M9N,
            GnssChoice::Custom(parameters) => parameters,
        })
    }

    /// Parameters of the motion capture.
    #[must_use]
    pub fn capture(&self) -> Option<CaptureParameters> {
        self.capture.map(|choice| match choice {
            CaptureChoice::Vicon => CaptureParameters::VICON,
            CaptureChoice::Custom(parameters) => parameters,
        })
    }

    /// Parameters of the rangefinder.
    #[must_use]
    pub fn rangefinder(&self) -> Option<RangefinderParameters> {
        self.rangefinder.map(|choice| match choice {
            RangefinderChoice::Vl53L1X => RangefinderParameters::VL53L1X,
            RangefinderChoice::Custom(parameters) => parameters,
        })
    }

    /// Parameters of the optical flow.
    #[must_use]
    pub fn flow(&self) -> Option<FlowParameters> {
        self.flow.map(|choice| match choice {
            FlowChoice::Pmw3901 => FlowParameters::PMW3901,
            FlowChoice::Custom(parameters) => parameters,
        })
    }

    /// The estimator's configuration, told of the sensors what their data sheets say; control ticks of
    /// `tick` (s).
    #[must_use]
    pub fn estimator(&self, tick: f64) -> EstimatorConfig {
        let imu = self.imu();
        let period = f64::from(imu.ticks_per_sample(tick)) * tick;
        let (gyro, accelerometer) = imu.densities(imu.sample_period(tick));
        let (gyro_bias, accelerometer_bias) = imu.walks();
        let mut config = EstimatorConfig {
            step_period: period as f32,
            inertial: InertialNoise {
                gyro: gyro as f32,
                accelerometer: accelerometer as f32,
                gyro_bias: gyro_bias as f32,
                accelerometer_bias: accelerometer_bias as f32,
                distortion: imu.distortion() as f32,
                motion_time: MOTION_TIME,
            },
            faults: FaultLimits { gate: GATE, ..EstimatorConfig::EXAMPLE.faults },
            ..EstimatorConfig::EXAMPLE
        };
        // The inertial samples are late themselves by the anti-alias filter, and the estimate with them.
        let late = imu.filter_delay(tick);
        let whole = |delay: f64| (((delay / tick).round() * tick - late).max(0.0)) as f32;
        let source = |deviation: f64, vertical: f64, delay: f64, rate: f64| SourceConfig {
            deviation: deviation as f32,
            deviation_vertical: vertical as f32,
            delay: whole(delay),
            timeout: (MISSED_SAMPLES / rate) as f32,
        };
        if let Some(it) = self.barometer() {
            config.barometer = source(it.deviation(), it.deviation(), it.delay, it.rate);
            let (deviation, walk) = it.height_bias();
            config.barometer_bias =
                BarometerBias { deviation: deviation as f32, walk: walk as f32 };
        }
        if let Some(it) = self.magnetometer() {
            config.magnetometer = source(it.deviation(), it.deviation(), it.delay, it.rate);
            config.magnetic_field_world = it.field_world.as_vec3();
        }
        if let Some(it) = self.gnss() {
            let (position, velocity) = (it.position_deviation(), it.velocity_deviation());
            config.gnss_position = source(position.x, position.z, it.delay, it.rate);
            config.gnss_velocity = source(velocity.x, velocity.z, it.delay, it.rate);
        }
        if let Some(it) = self.capture() {
            let (position, attitude) = it.deviations();
            config.capture_position = source(position, position, it.delay, it.rate);
            config.capture_attitude = source(attitude, attitude, it.delay, it.rate);
        }
        if let Some(it) = self.rangefinder() {
            config.rangefinder = source(it.deviation(), it.deviation(), it.delay, it.rate);
        }
        if let Some(it) = self.flow() {
            let flow = source(it.noise, it.noise, it.delay, it.rate);
            config.optical_flow = SourceConfig { delay: (it.age() - late).max(0.0) as f32, ..flow };
        }
        config.initial = self.initial(&config);
        config
    }

    /// Deviations at the start: those of one measurement of each kind, and of the unit's offsets.
    fn initial(&self, config: &EstimatorConfig) -> InitialDeviation {
        let (gyro, _) = self.imu().offsets();
        let accelerometer = self.imu().hover_deviation();
        let (position, velocity) = match (self.capture, self.gnss) {
            (Some(_), _) => (config.capture_position.deviation, 0.02),
            (None, Some(_)) => (config.gnss_position.deviation, 0.05),
            (None, None) => (0.1, 0.02),
        };
        InitialDeviation {
            position,
            velocity,
            tilt: 0.005,
            heading: 0.02,
            gyro_bias: (gyro as f32).max(1e-6),
            accelerometer_bias: (accelerometer as f32).max(1e-6),
        }
    }
}

/// Gate of the innovations: a good number lies outside, beyond five deviations, once in 1.7 million times.
const GATE: f32 = 25.0;
/// Time over which distortion adds up in the motion of a multirotor (s).
const MOTION_TIME: f32 = 0.3;
/// Sample periods without an accepted sample after which a source is missing.
const MISSED_SAMPLES: f64 = 10.0;
