//! Many numbers of one type, in memory of their own or in a mapped file.

use bytemuck::Pod;
use memmap2::{Mmap, MmapOptions};
use std::fmt;
use std::fs::File;
use std::io;
use std::marker::PhantomData;
use std::ops::Deref;
use std::sync::Arc;

/// A slice of numbers that owns them, or that lies in a file which the system reads page by page as they are asked for.
///
/// # Mapped files
///
/// What is mapped is what the file holds when a page is read, not when it was opened. If another program writes to it meanwhile, its numbers
/// may change between two looks: pictures and figures then are of neither the one nor the other. If another program makes it
/// shorter, the system ends octetra (SIGBUS on Unix) at the first look at what is gone: there is no way to give an error instead. A file that is replaced
/// by renaming, as octetra writes all of its own, does no harm: the old one stays until it is let go. Files on network drives whose server fails end
/// octetra likewise. On Windows a mapped file cannot be made shorter or deleted.
#[derive(Clone)]
pub struct Numbers<T>(Store<T>);

#[derive(Clone)]
enum Store<T> {
    Owned(Vec<T>),
    Mapped(Arc<Mmap>, PhantomData<T>),
}

impl<T: Pod> Numbers<T> {
    /// `count` numbers of a file from byte `at` on, as this machine has them in memory. `None` where they do not lie on addresses that are whole
    /// multiples of their size, or are not all there.
    pub fn map(file: &File, at: u64, count: usize) -> io::Result<Option<Self>> {
        let bytes = count.checked_mul(size_of::<T>());
        let end = bytes.and_then(|bytes| at.checked_add(bytes as u64));
        let (Some(bytes), Some(end)) = (bytes, end) else { return Ok(None) };
        if bytes == 0 || !at.is_multiple_of(align_of::<T>() as u64) || end > file.metadata()?.len() {
            return Ok(None);
        }
        #[expect(
            unsafe_code,
            reason = "a map is unsafe since others may change the file; any bytes are sound numbers, see the type's docs for the rest"
        )]
        // SAFETY: `T` is plain data, of which every pattern of bits is a value, and nothing that is read is relied upon for memory safety: lengths
        // and places come from elsewhere. So a change by another program gives other numbers, no undefined index or pointer. The
        // map lies within the file as it is now; if that is made shorter, a look is a fault that ends the program.
        let map = unsafe { MmapOptions::new().offset(at).len(bytes).map(file)? };
        Ok(bytemuck::try_cast_slice::<u8, T>(&map).is_ok().then(|| Numbers(Store::Mapped(Arc::new(map), PhantomData))))
    }

    /// Whether they lie in a mapped file.
    pub fn is_mapped(&self) -> bool {
        matches!(self.0, Store::Mapped(..))
    }

    /// The numbers to be changed; those of a file are copied first, and the file is let go.
    pub fn to_mut(&mut self) -> &mut [T] {
        if self.is_mapped() {
            self.0 = Store::Owned(self.to_vec());
        }
        match &mut self.0 {
            Store::Owned(numbers) => numbers,
            Store::Mapped(..) => unreachable!("copied just now"),
        }
    }
}

impl<T: Pod> Numbers<T> {
    /// The numbers as a vector; those of a file are copied.
    pub fn into_vec(self) -> Vec<T> {
        match self.0 {
            Store::Owned(numbers) => numbers,
            Store::Mapped(..) => self.to_vec(),
        }
    }
}

impl<T: Pod> Deref for Numbers<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Store::Owned(numbers) => numbers,
            Store::Mapped(map, _) => bytemuck::cast_slice(map),
        }
    }
}

impl<T> From<Vec<T>> for Numbers<T> {
    fn from(numbers: Vec<T>) -> Self {
        Numbers(Store::Owned(numbers))
    }
}

impl<T> FromIterator<T> for Numbers<T> {
    fn from_iter<I: IntoIterator<Item = T>>(numbers: I) -> Self {
        Vec::from_iter(numbers).into()
    }
}

impl<T: Pod + PartialEq> PartialEq for Numbers<T> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for Numbers<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn file(bytes: &[u8]) -> File {
        let mut file = tempfile::tempfile().expect("a temporary file");
        file.write_all(bytes).expect("written");
        file
    }

    #[test]
    fn mapped_numbers_are_those_of_the_file_until_they_are_changed() {
        let bytes: Vec<u8> = [[9u8; 4], 1.5f32.to_ne_bytes(), (-2f32).to_ne_bytes(), [7; 4]].concat();
        let mut mapped = Numbers::<f32>::map(&file(&bytes), 4, 2).expect("maps").expect("aligned");
        assert!(mapped.is_mapped());
        assert_eq!((&mapped[..], &mapped), (&[1.5, -2.0][..], &Numbers::from(vec![1.5, -2.0])));
        let other = mapped.clone();
        mapped.to_mut()[0] = 3.0;
        assert_eq!((mapped.is_mapped(), mapped[0], other[0]), (false, 3.0, 1.5), "the file stays as it is");
    }

    #[test]
    fn what_is_not_aligned_or_not_there_is_not_mapped() {
        let file = file(&[0; 24]);
        for (at, count) in [(2, 2), (8, 5), (24, 1), (0, 0), (u64::MAX - 3, 1), (0, usize::MAX)] {
            assert!(Numbers::<f32>::map(&file, at, count).expect("no failure").is_none(), "{count} from byte {at}");
        }
        assert!(Numbers::<u8>::map(&file, 23, 1).expect("no failure").is_some());
    }
}
