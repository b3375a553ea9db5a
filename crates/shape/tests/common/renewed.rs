//! Damaged `.grain` files with a correct checksum.

use sha2::{Digest, Sha256};

/// Returns the file with the length of its body (bytes 12 to 19) and its checksum (the last 32
/// bytes) corrected.
pub fn renewed(bytes: &[u8]) -> Vec<u8> {
    let mut file = bytes[..bytes.len().saturating_sub(32)].to_vec();
    let body = file.len().saturating_sub(20) as u64;
    if let Some(length) = file.get_mut(12..20) {
        length.copy_from_slice(&body.to_le_bytes());
    }
    let checksum = Sha256::digest(&file);
    file.extend(checksum);
    file
}
