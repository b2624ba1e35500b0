//! The serial port of the board's debug probe, found by its USB id.
//!
//! The NUCLEO's ST-LINK/V3 offers a virtual serial port. Linux tells the ids of the device behind a port in
//! `/sys/class/tty`; elsewhere the port has to be named.

use std::fs;
use std::path::{Path, PathBuf};

use crate::input_error::InputError;

/// STMicroelectronics.
const VENDOR: &str = "0483";
/// ST-LINK/V2-1 and V3 with a virtual serial port.
const PRODUCTS: [&str; 8] = ["374b", "374d", "374e", "374f", "3752", "3753", "3754", "3757"];

/// The port of the only probe that is plugged in.
///
/// # Errors
/// There is none, or more than one.
pub fn only_probe() -> Result<String, InputError> {
    choose(&probes(Path::new("/sys/class/tty")))
}

fn choose(found: &[String]) -> Result<String, InputError> {
    let refuse = |problem: &str| InputError::new(problem).key("--port");
    match found {
        [only] => Ok(only.clone()),
        [] => Err(refuse("no port is given, and no ST-LINK was found on USB").allowed(
            "--port with a serial port such as /dev/ttyACM0, or the one that the served virtual bench prints",
        )),
        several => {
            Err(refuse("no port is given, and more than one ST-LINK is plugged in")
                .allowed(several.join(", ")))
        }
    }
}

/// Ports of probes, by the ids of the USB devices behind the terminals in `class`.
fn probes(class: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(class) else { return Vec::new() };
    let mut found: Vec<String> = entries
        .flatten()
        .filter(|entry| is_probe(&entry.path()))
        .map(|entry| format!("/dev/{}", entry.file_name().to_string_lossy()))
        .collect();
    found.sort();
    found
}

fn is_probe(terminal: &Path) -> bool {
    // `device` is the USB interface; the ids stand in the folder of the USB device above it.
    let Ok(interface) = fs::canonicalize(terminal.join("device")) else { return false };
    let id = |name: &str| -> Option<String> {
        interface.ancestors().take(3).find_map(|folder: &Path| {
            let file: PathBuf = folder.join(name);
            fs::read_to_string(file).ok().map(|text| text.trim().to_lowercase())
        })
    };
    id("idVendor").as_deref() == Some(VENDOR)
        && id("idProduct").is_some_and(|product| PRODUCTS.contains(&product.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_probe_is_known_by_the_ids_of_its_usb_device() {
        let root = tempfile::tempdir().unwrap();
        let device = |name: &str, vendor: &str, product: &str| {
            let usb = root.path().join("devices").join(name);
            let interface = usb.join("1-1:1.2");
            let terminal = root.path().join("class").join(name);
            fs::create_dir_all(&interface).unwrap();
            fs::create_dir_all(&terminal).unwrap();
            fs::write(usb.join("idVendor"), format!("{vendor}\n")).unwrap();
            fs::write(usb.join("idProduct"), format!("{product}\n")).unwrap();
            std::os::unix::fs::symlink(&interface, terminal.join("device")).unwrap();
        };
        device("ttyACM0", "0483", "374e");
        device("ttyUSB0", "0403", "6001");
        device("ttyACM1", "0483", "5740");
        fs::create_dir_all(root.path().join("class/tty0")).unwrap();
        assert_eq!(probes(&root.path().join("class")), ["/dev/ttyACM0"]);
        device("ttyACM2", "0483", "374B");
        let found = probes(&root.path().join("class"));
        let error = choose(&found).unwrap_err().to_string();
        assert!(error.ends_with("allowed: /dev/ttyACM0, /dev/ttyACM2"), "{error}");
        assert!(choose(&[]).unwrap_err().to_string().contains("no ST-LINK was found"));
    }
}
