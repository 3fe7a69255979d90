//! The bytes of a file, read by place from several threads.

use std::fs::File;
use std::io;

/// An open file, or bytes in memory.
#[derive(Debug)]
pub(in crate::format) enum Input {
    /// A regular file and its length in bytes.
    File(File, u64),
    /// Bytes in memory.
    Bytes(Vec<u8>),
}

impl Input {
    /// Length in bytes.
    pub fn len(&self) -> u64 {
        match self {
            Input::File(_, len) => *len,
            Input::Bytes(bytes) => bytes.len() as u64,
        }
    }

    /// Fills `out` from byte `at` on; an error of kind `UnexpectedEof` where the file ends before.
    pub fn read_at(&self, at: u64, out: &mut [u8]) -> io::Result<()> {
        match self {
            Input::File(file, _) => read_file_at(file, at, out),
            Input::Bytes(bytes) => {
                let start = usize::try_from(at).unwrap_or(usize::MAX);
                let found = start.checked_add(out.len()).and_then(|end| bytes.get(start..end));
                out.copy_from_slice(found.ok_or(io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
        }
    }

    /// `N` bytes from byte `at` on.
    pub fn array_at<const N: usize>(&self, at: u64) -> io::Result<[u8; N]> {
        let mut out = [0; N];
        self.read_at(at, &mut out)?;
        Ok(out)
    }
}

#[cfg(unix)]
fn read_file_at(file: &File, at: u64, out: &mut [u8]) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, at)
}

#[cfg(windows)]
fn read_file_at(file: &File, mut at: u64, mut out: &mut [u8]) -> io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !out.is_empty() {
        match file.seek_read(out, at) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                out = &mut out[count..];
                at += count as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
