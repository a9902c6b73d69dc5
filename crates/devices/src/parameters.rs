//! DeviceParameters of a device: names, units, defaults and what a file overrides.

use crate::error::DeviceError;
use std::collections::BTreeMap;

/// A number that a device takes, for `ndof list devices` and for the overrides of an experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceParameter {
    /// Its name, unit last.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it is where the experiment says nothing.
    pub default: f64,
    /// What it does.
    pub description: &'static str,
}

/// Short form of a [`DeviceParameter`] for tables.
pub(crate) const fn parameter(name: &'static str, unit: &'static str, default: f64, description: &'static str) -> DeviceParameter {
    DeviceParameter { name, unit, default, description }
}

/// The parameters of one device with an experiment's overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceParameters {
    values: Vec<(&'static str, f64)>,
}

impl DeviceParameters {
    /// The defaults of `table`, overridden.
    ///
    /// # Errors
    /// [`DeviceError::UnknownParameter`] if a name is not in the table, [`DeviceError::Value`] if a number is not finite.
    pub fn new(device: &str, table: &[DeviceParameter], overrides: &BTreeMap<String, f64>) -> Result<Self, DeviceError> {
        let mut values: Vec<_> = table.iter().map(|p| (p.name, p.default)).collect();
        for (name, value) in overrides {
            let Some(entry) = values.iter_mut().find(|(known, _)| known == name) else {
                let available = table.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
                return Err(DeviceError::UnknownParameter { device: device.to_owned(), name: name.clone(), available });
            };
            if !value.is_finite() {
                return Err(DeviceError::value(format!("device.parameters.{name}"), *value, "finite"));
            }
            entry.1 = *value;
        }
        Ok(DeviceParameters { values })
    }

    /// Sets `name`, which the table has.
    pub(crate) fn set(&mut self, name: &str, value: f64) {
        self.values.iter_mut().filter(|(known, _)| *known == name).for_each(|entry| entry.1 = value);
    }

    /// The value of `name`; NaN for a name that the table lacks, which no device lets pass.
    pub(crate) fn value(&self, name: &str) -> f64 {
        self.values.iter().find(|(known, _)| *known == name).map_or(f64::NAN, |(_, v)| *v)
    }
}
