//! The devices and limbs that there are.

use crate::device::{DeviceEntry, LimbEntry};
use crate::error::DeviceError;
use crate::limb::{endpoint_linear, planar_two_link, spring_array, wrist as wrist_limb};
use crate::{five_bar, wrist};

/// The devices that there are.
pub static DEVICES: &[&DeviceEntry] = &[&five_bar::MIT_MANUS, &five_bar::IN_MOTION_2, &wrist::WRIST];

/// The limbs that there are.
pub static LIMBS: &[&LimbEntry] = &[&endpoint_linear::ENTRY, &planar_two_link::ENTRY, &spring_array::ENTRY, &wrist_limb::ENTRY];

/// The entry called `name`.
///
/// # Errors
/// [`DeviceError::UnknownDevice`] with the names that there are.
///
/// ```
/// use ndof_devices::device;
/// assert!(device("mit-manus")?.parameters.iter().any(|p| p.name == "coulomb_1_nm" && p.unit == "N m"));
/// assert!(device("mit-manos").is_err_and(|error| error.to_string().contains("mit-manus")));
/// # Ok::<(), ndof_devices::DeviceError>(())
/// ```
pub fn device(name: &str) -> Result<&'static DeviceEntry, DeviceError> {
    DEVICES
        .iter()
        .copied()
        .find(|d| d.name == name)
        .ok_or_else(|| DeviceError::UnknownDevice { name: name.to_owned(), available: DEVICES.iter().map(|d| d.name).collect::<Vec<_>>().join(", ") })
}
