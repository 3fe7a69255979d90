//! The bytes of a file, in memory or on disk, read by place.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

/// Where a reader finds its bytes. A file on disk is read piece by piece, so that a large one never lies in memory as a whole.
#[derive(Debug)]
pub(super) enum Source<'a> {
    /// Bytes in memory.
    Bytes(&'a [u8]),
    /// An open regular file and its length in bytes. One thread at a time may read it.
    File(&'a File, u64),
}

impl Source<'_> {
    /// The same bytes once more.
    pub fn again(&self) -> Source<'_> {
        match self {
            Source::Bytes(bytes) => Source::Bytes(bytes),
            Source::File(file, len) => Source::File(file, *len),
        }
    }

    /// Length in bytes.
    pub fn len(&self) -> u64 {
        match self {
            Source::Bytes(bytes) => bytes.len() as u64,
            Source::File(_, len) => *len,
        }
    }

    /// The `len` bytes from byte `at` on. The caller has checked that they exist; a file that shrank meanwhile is an I/O error.
    pub fn read(&self, at: u64, len: usize) -> io::Result<Cow<'_, [u8]>> {
        match self {
            Source::Bytes(bytes) => {
                let start = usize::try_from(at).unwrap_or(usize::MAX);
                let found = start.checked_add(len).and_then(|end| bytes.get(start..end));
                found.map(Cow::Borrowed).ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
            }
            Source::File(file, _) => {
                let mut file = *file;
                file.seek(SeekFrom::Start(at))?;
                let mut bytes = Vec::new();
                bytes.try_reserve_exact(len)?;
                file.take(len as u64).read_to_end(&mut bytes)?;
                if bytes.len() == len { Ok(Cow::Owned(bytes)) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
            }
        }
    }

    /// A stream over everything from the first byte on.
    pub fn stream(&self) -> io::Result<Box<dyn BufRead + '_>> {
        Ok(match self {
            Source::Bytes(bytes) => Box::new(*bytes),
            Source::File(file, _) => {
                let mut file = *file;
                file.seek(SeekFrom::Start(0))?;
                Box::new(BufReader::with_capacity(1 << 16, file))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn file_and_slice_read_alike_and_know_their_end() {
        let mut file = tempfile::tempfile().expect("a temporary file");
        file.write_all(b"0123456789").expect("written");
        for source in [Source::Bytes(b"0123456789"), Source::File(&file, 10)] {
            assert_eq!(&*source.read(3, 4).expect("inside"), b"3456");
            assert!(source.read(8, 3).is_err() && source.read(u64::MAX, 2).is_err());
            let mut all = String::new();
            source.stream().expect("rewound").read_to_string(&mut all).expect("text");
            assert_eq!((all.as_str(), source.len()), ("0123456789", 10));
        }
    }
}
