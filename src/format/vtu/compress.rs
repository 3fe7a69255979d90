//! Compressed arrays: the table of blocks that precedes them, and the three compressors of VTK.
//!
//! No size that a file states is believed before it agrees with the length that the array must have, and even then memory grows only
//! as data really come out.

use std::io::Read;

/// LZMA's window is limited to this (KiB): preset 9, the largest of `xz`, takes 64 MiB.
const LZMA_LIMIT_KIB: u32 = 80 << 10;

/// Bytes a block may get at once, whatever its compressed size.
const SMALL_BLOCK: usize = 1 << 20;

/// One of VTK's data compressors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::format) enum Compressor {
    /// `vtkZLibDataCompressor`: a zlib stream a block.
    Zlib,
    /// `vtkLZ4DataCompressor`: a raw LZ4 block, without a frame.
    Lz4,
    /// `vtkLZMADataCompressor`: an xz container a block.
    Lzma,
}

impl Compressor {
    /// All of them, by the name that the attribute `compressor` gives them.
    pub const NAMES: [(&'static str, Compressor); 3] = [
        ("vtkZLibDataCompressor", Compressor::Zlib),
        ("vtkLZ4DataCompressor", Compressor::Lz4),
        ("vtkLZMADataCompressor", Compressor::Lzma),
    ];

    /// What a block of exactly `size` bytes was before compression. The reason if it is damaged or has another size.
    pub fn inflate(self, block: &[u8], size: usize) -> Result<Vec<u8>, String> {
        match self {
            Compressor::Zlib => read_exactly(flate2::bufread::ZlibDecoder::new(block), block.len(), size),
            Compressor::Lzma => read_exactly(lzma_rust2::XzReader::new_mem_limit(block, false, LZMA_LIMIT_KIB), block.len(), size),
            Compressor::Lz4 => inflate_lz4(block, size),
        }
    }
}

/// All that a decoder yields, which must be `size` bytes. Memory grows with what arrives.
fn read_exactly(decoder: impl Read, compressed: usize, size: usize) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    out.try_reserve_exact(size.min(SMALL_BLOCK.max(compressed.saturating_mul(4)))).map_err(|e| e.to_string())?;
    decoder.take(size as u64 + 1).read_to_end(&mut out).map_err(|e| e.to_string())?;
    match out.len() {
        found if found == size => Ok(out),
        found if found > size => Err(format!("it holds more than {size} bytes")),
        found => Err(format!("it holds {found} bytes")),
    }
}

fn inflate_lz4(block: &[u8], size: usize) -> Result<Vec<u8>, String> {
    // LZ4 wants its room in advance: a large block first shows by its tokens that it will fill it.
    if size > SMALL_BLOCK && lz4_size(block) != Some(size) {
        return Err("it holds another number of bytes".into());
    }
    let mut out = Vec::new();
    out.try_reserve_exact(size).map_err(|e| e.to_string())?;
    out.resize(size, 0);
    match lz4_flex::block::decompress_into(block, &mut out) {
        Ok(found) if found == size => Ok(out),
        Ok(found) => Err(format!("it holds {found} bytes")),
        Err(e) => Err(e.to_string()),
    }
}

/// The bytes that the tokens of an LZ4 block add up to; `None` if it ends inside one.
fn lz4_size(mut block: &[u8]) -> Option<usize> {
    fn take<'a>(block: &mut &'a [u8], n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = block.split_at_checked(n)?;
        *block = rest;
        Some(taken)
    }
    fn length(block: &mut &[u8], nibble: u8) -> Option<usize> {
        let mut total = usize::from(nibble);
        let mut more = nibble == 15;
        while more {
            let byte = take(block, 1)?[0];
            total = total.checked_add(usize::from(byte))?;
            more = byte == 255;
        }
        Some(total)
    }
    let mut size = 0_usize;
    loop {
        let token = take(&mut block, 1)?[0];
        let literals = length(&mut block, token >> 4)?;
        take(&mut block, literals)?;
        size = size.checked_add(literals)?;
        if block.is_empty() {
            return Some(size);
        }
        take(&mut block, 2)?;
        size = size.checked_add(length(&mut block, token & 15)?)?.checked_add(4)?;
    }
}

/// How an array is cut into blocks, as its first three header words say: `[blocks, block size, size of the last]`, the last size being
/// 0 when the last block is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BlockTable {
    /// How many blocks follow.
    pub blocks: u64,
    block_size: u64,
    last_size: u64,
}

impl BlockTable {
    /// The table of an array that must have `expected` bytes; `None` if the words add up to something else.
    pub fn new([blocks, block_size, last_size]: [u64; 3], expected: u64) -> Option<Self> {
        let last_size = if last_size == 0 { block_size } else { last_size };
        let total = blocks.checked_sub(1)?.checked_mul(block_size)?.checked_add(last_size)?;
        (total == expected && last_size <= block_size && blocks <= expected).then_some(BlockTable { blocks, block_size, last_size })
    }

    /// Bytes of block `i` before compression.
    pub fn size(&self, i: u64) -> u64 {
        if i + 1 == self.blocks { self.last_size } else { self.block_size }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::io::Write;

    /// A block compressed.
    pub fn deflate(compressor: Compressor, bytes: &[u8]) -> Vec<u8> {
        match compressor {
            Compressor::Zlib => {
                let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
                encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes everything")
            }
            Compressor::Lz4 => lz4_flex::block::compress(bytes),
            Compressor::Lzma => {
                let options = lzma_rust2::XzOptions::with_preset(1);
                let mut encoder = lzma_rust2::XzWriter::new(Vec::new(), options).expect("a preset");
                encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes everything")
            }
        }
    }

    #[test]
    fn blocks_come_back_and_other_sizes_are_refused() {
        let samples = [vec![], vec![7; 3_000_000], (0..100_000_u32).flat_map(|i| (i.wrapping_mul(i) % 977).to_le_bytes()).collect()];
        for (name, compressor) in Compressor::NAMES {
            for bytes in &samples {
                let block = deflate(compressor, bytes);
                assert_eq!(compressor.inflate(&block, bytes.len()).as_ref(), Ok(bytes), "{name}");
                for size in [bytes.len() + 1, bytes.len().saturating_sub(1), 1 << 40] {
                    assert!(size == bytes.len() || compressor.inflate(&block, size).is_err(), "{name} {size}");
                }
                assert!(compressor.inflate(&block[..block.len() / 2], bytes.len()).is_err(), "{name} cut");
            }
        }
    }

    #[test]
    fn a_large_lzma_window_is_refused() {
        let mut options = lzma_rust2::XzOptions::with_preset(1);
        options.lzma_options.dict_size = 1 << 30;
        let mut encoder = lzma_rust2::XzWriter::new(Vec::new(), options).expect("a legal size");
        encoder.write_all(&[1, 2, 3]).expect("written");
        let block = encoder.finish().expect("finished");
        assert!(Compressor::Lzma.inflate(&block, 3).is_err());
    }

    #[test]
    fn the_size_of_an_lz4_block_is_that_of_its_content() {
        for bytes in [vec![], vec![1; 100_000], (0..5000_u16).flat_map(u16::to_le_bytes).collect()] {
            assert_eq!(lz4_size(&deflate(Compressor::Lz4, &bytes)), Some(bytes.len()));
        }
        assert_eq!(lz4_size(&[0xF0, 255]), None);
    }

    #[test]
    fn tables_must_add_up() {
        let table = BlockTable::new([3, 100, 50], 250).expect("adds up");
        assert_eq!([0, 1, 2].map(|i| table.size(i)), [100, 100, 50]);
        assert_eq!(BlockTable::new([2, 100, 0], 200).map(|t| t.size(1)), Some(100), "0: the last block is full");
        for words in [[1 << 60, 32768, 0], [0, 0, 0], [u64::MAX, u64::MAX, 1], [3, 100, 51], [1, 100, 250], [250, 1, 2]] {
            assert_eq!(BlockTable::new(words, 250), None, "{words:?}");
        }
    }
}
