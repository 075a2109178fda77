//! The analogue inputs: calibrated one-shot conversions of ADC1, as codes of the robot file's converter.

use control::AdcCode;
use esp_hal::Blocking;
use esp_hal::analog::adc::{Adc, AdcCalScheme, AdcChannel, AdcConfig, AdcPin, Attenuation};
use esp_hal::peripherals::ADC1;
use shell::adc::Curve;
use shell::board::Converter;

use crate::board::{self, Calibration, Cell, SecondWiper, Wiper};

type Unit = ADC1<'static>;
type Input<P> = AdcPin<P, Unit, Calibration>;

/// Highest raw code of both chips.
const FULL_SCALE: u16 = 4095;

/// Wiper and cell.
pub struct Inputs {
    adc: Adc<'static, Unit, Blocking>,
    wiper: Input<Wiper>,
    /// Where the robot file has a second sensor: elsewhere its pin is left alone.
    second: Option<Input<SecondWiper>>,
    cell: Input<Cell>,
    curve: Curve,
    /// What the calibration makes of raw 0 and of raw full scale, mV: at the ends it has nothing to go by.
    low_end: u16,
    high_end: u16,
}

impl Inputs {
    /// Sets the converter up: 11 dB, its widest range, and the calibration that the factory burnt into the chip.
    #[must_use]
    pub fn new(pins: board::Analog, curve: Curve, has_second: bool) -> Self {
        let mut config = AdcConfig::new();
        let wiper: Input<Wiper> = config.enable_pin_with_cal(pins.wiper, Attenuation::_11dB);
        let second = has_second.then(|| config.enable_pin_with_cal(pins.second, Attenuation::_11dB));
        let cell: Input<Cell> = config.enable_pin_with_cal(pins.cell, Attenuation::_11dB);
        let [low_end, high_end] = [0, FULL_SCALE].map(|raw| wiper.cal_scheme.adc_val(raw));
        let adc = Adc::new(pins.adc, config);
        board::power_the_converter();
        Self { adc, wiper, second, cell, curve, low_end, high_end }
    }

    /// A reading at an end of the converter says only that: it becomes the end of the robot file's converter.
    fn code(&self, millivolt: u16) -> AdcCode {
        if millivolt <= self.low_end {
            AdcCode(0)
        } else if millivolt >= self.high_end {
            self.curve.top()
        } else {
            self.curve.code(millivolt)
        }
    }
}

/// Waits for one conversion, mV. A converter that never ends it is the watchdog's business.
fn convert<P: AdcChannel>(adc: &mut Adc<'static, Unit, Blocking>, input: &mut Input<P>) -> u16 {
    loop {
        // The first step starts it, the others ask whether it is done.
        if let Ok(millivolt) = board::convert_step(|| adc.read_oneshot(input)) {
            return millivolt;
        }
    }
}

impl Converter for Inputs {
    fn angle(&mut self) -> AdcCode {
        let millivolt = convert(&mut self.adc, &mut self.wiper);
        self.code(millivolt)
    }

    fn second(&mut self) -> Option<AdcCode> {
        let millivolt = convert(&mut self.adc, self.second.as_mut()?);
        Some(self.code(millivolt))
    }

    fn battery(&mut self) -> AdcCode {
        let millivolt = convert(&mut self.adc, &mut self.cell);
        self.code(millivolt)
    }
}
