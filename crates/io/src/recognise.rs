//! What tells formats apart whose first bytes do not, whether or not they are built in.

/// Bytes at the end of a ZIP in which its directory is looked for.
const DIRECTORY: usize = 1 << 20;

/// Bytes in which the header of OpenSim ends; it has a few hundred.
const HEADER: usize = 1 << 16;

/// Whether this is a ZIP.
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    [&b"PK\x03\x04"[..], b"PK\x05\x06"].iter().any(|start| bytes.starts_with(start))
}

/// Whether this is a ZIP whose directory lists a C3D file.
pub(crate) fn is_zip_of_c3d(bytes: &[u8]) -> bool {
    let tail = &bytes[bytes.len().saturating_sub(DIRECTORY)..];
    // An entry: its mark, 24 bytes, the length of its name, 16 bytes, the name.
    let name = |entry: &[u8]| {
        let length = entry.get(28..30).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])))?;
        entry.get(46..46 + length).map(|name| name.to_ascii_lowercase().ends_with(b".c3d"))
    };
    is_zip(bytes) && tail.windows(4).enumerate().any(|(at, four)| four == b"PK\x01\x02" && name(&tail[at..]) == Some(true))
}

/// Whether this is a C3D file: the key, and a processor in the parameters.
pub(crate) fn is_c3d(bytes: &[u8]) -> bool {
    let [block, 0x50, ..] = bytes else { return false };
    *block > 1 && bytes.get((usize::from(*block) - 1) * 512 + 3).is_some_and(|processor| (84..=86).contains(processor))
}

/// Whether this is text with the line that ends a header of OpenSim.
pub(crate) fn is_opensim(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEADER)];
    !head.contains(&0) && head.split(|b| *b == b'\n').any(|line| line.trim_ascii().eq_ignore_ascii_case(b"endheader"))
}
