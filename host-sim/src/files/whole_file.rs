//! A Parquet file in memory, as its library reads it, whose end is an error.
//!
//! The library skips what a damaged page header says to be there, up to 2³¹ times, and does not notice that a reader at its
//! end gives nothing: a file of a few hundred bytes then takes a minute.

use bytes::Bytes;
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{ChunkReader, Length};
use std::io::{self, Read};

/// All bytes of a file.
pub(super) struct WholeFile(pub(super) Bytes);

/// Reads on from somewhere in it; to want more than there is, is an error.
pub(super) struct UntilEnd(Bytes);

impl Length for WholeFile {
    fn len(&self) -> u64 {
        self.0.len() as u64
    }
}

impl WholeFile {
    /// `length` bytes from `start` on, or all that follow it.
    fn part(&self, start: u64, length: Option<usize>) -> Result<Bytes> {
        let begin = usize::try_from(start).ok().filter(|begin| *begin <= self.0.len());
        let range = begin.and_then(|begin| {
            let end = length.map_or(Some(self.0.len()), |length| begin.checked_add(length));
            end.filter(|end| *end <= self.0.len()).map(|end| begin..end)
        });
        let range = range
            .ok_or_else(|| ParquetError::EOF(format!("{length:?} bytes at {start} of {}", self.0.len())))?;
        Ok(self.0.slice(range))
    }
}

impl ChunkReader for WholeFile {
    type T = UntilEnd;

    fn get_read(&self, start: u64) -> Result<UntilEnd> {
        self.part(start, None).map(UntilEnd)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        self.part(start, Some(length))
    }
}

impl Read for UntilEnd {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.0.is_empty() && !buffer.is_empty() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let length = buffer.len().min(self.0.len());
        buffer[..length].copy_from_slice(&self.0.split_to(length));
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reads_to_its_end_and_not_past_it() {
        let file = WholeFile(Bytes::from_static(b"abcdef"));
        let mut buffer = [0; 4];
        let mut reader = file.get_read(3).unwrap();
        assert_eq!(reader.read(&mut buffer).unwrap(), 3);
        assert_eq!(&buffer[..3], b"def");
        assert_eq!(reader.read(&mut buffer).unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
        assert_eq!(file.get_bytes(2, 4).unwrap(), "cdef");
        for (start, length) in [(2, 5), (7, 0), (u64::MAX, 1), (1, usize::MAX)] {
            assert!(file.get_bytes(start, length).is_err(), "{length} at {start}");
        }
    }
}
