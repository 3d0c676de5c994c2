//! Wavelengths, sampled and stored spectra, colour spaces, RGB uplifting, sensors and measured data.
#![forbid(unsafe_code)]
