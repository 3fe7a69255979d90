//! A folder as the storage of a Zarr hierarchy in which every file is whole or not there.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::byte_range::ByteRangeIterator;
use zarrs::storage::{
    Bytes, MaybeBytes, MaybeBytesIterator, OffsetBytesIterator, ReadableStorageTraits, StorageError, StoreKey, StorePrefix,
    WritableStorageTraits,
};

/// What the name of a file that is being written ends with.
pub const UNFINISHED: &str = ".unfinished";

/// Files of a folder. Each is written beside its place, and moved there when it is whole and on the disk; one that is written before
/// another is there before it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    read: FilesystemStore,
}

impl Folder {
    /// The files of a folder, which need not exist yet.
    pub fn new(path: &Path) -> io::Result<Self> {
        Ok(Folder { path: path.to_owned(), read: FilesystemStore::new(path).map_err(io::Error::other)? })
    }

    fn file(&self, key: &StoreKey) -> PathBuf {
        self.path.join(key.as_str())
    }
}

impl ReadableStorageTraits for Folder {
    fn get_partial_many<'a>(&'a self, key: &StoreKey, ranges: ByteRangeIterator<'a>) -> Result<MaybeBytesIterator<'a>, StorageError> {
        self.read.get_partial_many(key, ranges)
    }

    fn get(&self, key: &StoreKey) -> Result<MaybeBytes, StorageError> {
        self.read.get(key)
    }

    fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
        self.read.size_key(key)
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}

impl WritableStorageTraits for Folder {
    fn set(&self, key: &StoreKey, value: Bytes) -> Result<(), StorageError> {
        let path = self.file(key);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut unfinished = path.clone().into_os_string();
        unfinished.push(UNFINISHED);
        let mut file = File::create(&unfinished)?;
        file.write_all(&value)?;
        file.sync_data()?;
        drop(file);
        fs::rename(&unfinished, &path)?;
        #[cfg(unix)]
        if let Some(folder) = path.parent() {
            File::open(folder)?.sync_all()?;
        }
        Ok(())
    }

    fn set_partial_many(&self, _: &StoreKey, _: OffsetBytesIterator<'_>) -> Result<(), StorageError> {
        Err(StorageError::Unsupported("files are written as a whole".into()))
    }

    fn supports_set_partial(&self) -> bool {
        false
    }

    fn erase(&self, key: &StoreKey) -> Result<(), StorageError> {
        match fs::remove_file(self.file(key)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(()),
        }
    }

    fn erase_prefix(&self, _: &StorePrefix) -> Result<(), StorageError> {
        Err(StorageError::Unsupported("files are removed one by one".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_written_whole_and_read_in_parts() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let store = Folder::new(&folder.path().join("new")).expect("a store");
        let key = StoreKey::new("a/b").expect("a key");
        assert_eq!(store.get(&key).expect("read"), None);
        store.set(&key, Bytes::from_static(b"first")).expect("written");
        store.set(&key, Bytes::from_static(b"second")).expect("written");
        assert_eq!(store.get(&key).expect("read").as_deref(), Some(&b"second"[..]));
        let part = store.get_partial(&key, zarrs::storage::byte_range::ByteRange::FromStart(1, Some(3)));
        assert_eq!(part.expect("read").as_deref(), Some(&b"eco"[..]));
        let names: Vec<_> =
            fs::read_dir(folder.path().join("new/a")).expect("a folder").map(|entry| entry.expect("a file").file_name()).collect();
        assert_eq!(names, ["b"]);
        store.erase(&key).expect("removed");
        store.erase(&key).expect("not there is removed");
        assert_eq!(store.size_key(&key).expect("read"), None);
    }
}
