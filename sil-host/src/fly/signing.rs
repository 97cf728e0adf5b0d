//! Keys of MAVLink's signatures, and their clock.

use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use mavlink_vehicle::SigningKey;

use super::error::FlyError;

/// Seconds from 1970 to 2015, from which timestamps count.
const FROM_1970: Duration = Duration::from_secs(1_420_070_400);

/// The time now in signatures (10 us).
pub(super) fn now() -> u64 {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since_1970.saturating_sub(FROM_1970).as_micros() / 10).unwrap_or(u64::MAX)
}

/// Reads a key: its 64 hexadecimal digits are the first word of the file, as `sha256sum` prints them.
///
/// # Errors
/// [`FlyError::Key`] when the file cannot be read or begins with something else.
pub fn read_key(path: &Path) -> Result<SigningKey, FlyError> {
    let refused = |reason: String| FlyError::Key(path.to_owned(), reason);
    let text = fs::read_to_string(path).map_err(|error| refused(error.to_string()))?;
    let word = text.split_whitespace().next().unwrap_or_default();
    let bytes = decode(word).ok_or_else(|| {
        refused(format!("line 1: {} characters, not 64 hexadecimal digits", word.len()))
    })?;
    SigningKey::new(bytes).ok_or_else(|| refused("line 1: a key must not be zero".to_owned()))
}

fn decode(word: &str) -> Option<[u8; 32]> {
    let digits: Vec<_> = word.chars().map(|char| char.to_digit(16)).collect::<Option<_>>()?;
    let bytes: Vec<_> = digits.chunks_exact(2).map(|pair| (pair[0] << 4 | pair[1]) as u8).collect();
    if digits.len() == 64 { bytes.try_into().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(content: &str) -> Result<SigningKey, String> {
        let file = tempfile::NamedTempFile::with_suffix(".key").expect("made");
        fs::write(file.path(), content).expect("written");
        read_key(file.path()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_key_is_what_sha256sum_prints() {
        let digits = "c2eb71c56733482ad43db8f9b5d517f4eeb2f6365877aac8c13de0322b3f6fb1";
        let mut bytes = [0; 32];
        (bytes[0], bytes[1], bytes[31]) = (0xc2, 0xeb, 0xb1);
        let key = read(&format!("{digits}  -\n")).expect("a key");
        assert_eq!(Ok(key), read(&digits.to_uppercase()));
        assert_ne!(Some(key), SigningKey::new(bytes));
        let decoded = decode(digits).expect("digits");
        assert_eq!((decoded[0], decoded[1], decoded[31]), (0xc2, 0xeb, 0xb1));
    }

    #[test]
    fn what_is_no_key_is_refused_by_file_and_reason() {
        for (content, reason) in [
            ("", "line 1: 0 characters, not 64 hexadecimal digits"),
            ("c2eb", "line 1: 4 characters"),
            (&"g".repeat(64), "line 1: 64 characters, not 64 hexadecimal digits"),
            (&"0".repeat(64), "must not be zero"),
        ] {
            let error = read(content).expect_err(reason);
            assert!(error.contains(reason) && error.contains(".key: "), "{error}");
        }
        let missing = read_key(Path::new("no/such.key")).expect_err("missing").to_string();
        assert!(missing.starts_with("no/such.key: "), "{missing}");
    }

    #[test]
    fn the_clock_counts_from_2015() {
        let years = now() as f64 * 1e-5 / 31_557_600.0;
        assert!((10.0..80.0).contains(&years), "{years}");
    }
}
