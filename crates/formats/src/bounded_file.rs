//! Reading of whole files with a bound: devices, endless pipes and absurd sizes are errors.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Largest case, study or other file of settings [bytes].
pub const SETTINGS: u64 = 1 << 30;
/// Largest table or grain file [bytes].
pub const DATA: u64 = 16 << 30;

/// Reads a whole file of at most `limit` bytes.
///
/// # Errors
/// `InvalidInput` for a device, `FileTooLarge` beyond the limit, errors of the operating system.
pub fn read_bytes(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let too_large = |bytes: u64| {
        let what = format!("it has more than {bytes} bytes, and the limit is {limit}");
        io::Error::new(io::ErrorKind::FileTooLarge, what)
    };
    let claimed = file.metadata()?.len();
    if claimed > limit {
        return Err(too_large(claimed - 1));
    }
    let mut bytes = Vec::new();
    // The size of a pipe is unknown.
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large(limit)) } else { Ok(bytes) }
}

/// Reads a whole text of at most `limit` bytes.
///
/// # Errors
/// Those of [`read_bytes`], and `InvalidData` if the text is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    let bytes = read_bytes(path, limit)?;
    String::from_utf8(bytes).map_err(|error| {
        let (at, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
        let line = 1 + bytes[..at].iter().filter(|byte| **byte == b'\n').count();
        let what = format!("line {line} is not a text in UTF-8 (byte 0x{:02x})", bytes[at]);
        io::Error::new(io::ErrorKind::InvalidData, what)
    })
}

/// Opens a file that ends: a device is refused.
///
/// # Errors
/// `InvalidInput` for a device, and errors of the operating system.
pub fn open(path: &Path) -> io::Result<File> {
    // A device is not opened: that may wait for it, or set it in motion.
    if is_device(&std::fs::metadata(path)?) {
        let what = "it is a device, not a file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    File::open(path)
}

#[cfg(unix)]
fn is_device(metadata: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = metadata.file_type();
    kind.is_char_device() || kind.is_block_device() || kind.is_socket()
}

#[cfg(not(unix))]
fn is_device(_: &std::fs::Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_up_to_their_limit() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        std::fs::write(&file, "12345").unwrap();
        assert_eq!(read_text(&file, 5).unwrap(), "12345");
        let error = read_text(&file, 4).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(error.to_string(), "it has more than 4 bytes, and the limit is 4");
        std::fs::write(&file, b"\xff").unwrap();
        assert_eq!(read_text(&file, 4).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert_eq!(
            open(folder.path().join("b").as_path()).unwrap_err().kind(),
            io::ErrorKind::NotFound
        );
    }

    #[cfg(unix)]
    #[test]
    fn devices_and_endless_pipes_are_refused() {
        let error = read_bytes(Path::new("/dev/zero"), 10).unwrap_err();
        assert_eq!(error.to_string(), "it is a device, not a file");
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if !made.is_ok_and(|status| status.success()) {
            eprintln!("skipped: there is no mkfifo");
            return;
        }
        let source = pipe.clone();
        let writer = std::thread::spawn(move || {
            let mut out = std::fs::OpenOptions::new().write(true).open(source).unwrap();
            // Ends when the reader has closed the pipe.
            while io::Write::write_all(&mut out, &[b'x'; 4096]).is_ok() {}
        });
        let error = read_bytes(&pipe, 100_000).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        writer.join().unwrap();
    }
}
