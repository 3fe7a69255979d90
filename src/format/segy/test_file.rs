//! SEG-Y files made for tests.

use super::{Input, SegyError, SegyOptions, SegyVolume};
use crate::progress::Progress;

/// A trace to be written.
#[derive(Debug, Clone, Default)]
pub(in crate::format) struct Trace {
    pub inline: i32,
    pub crossline: i32,
    pub values: Vec<f64>,
    /// Other numbers of its header: byte (from 1), bytes of the number, value.
    pub more: Vec<(usize, usize, i64)>,
}

/// A file to be written.
#[derive(Debug, Clone)]
pub(in crate::format) struct TestFile {
    pub code: u16,
    pub is_little: bool,
    /// What follows the binary header: textual headers.
    pub text: Vec<u8>,
    /// Other numbers of the binary header: byte of the file (from 1), bytes of the number, value.
    pub more: Vec<(usize, usize, i64)>,
    pub line_bytes: [usize; 2],
    /// Headers of 240 bytes behind the first one of each trace.
    pub more_headers: usize,
    pub traces: Vec<Trace>,
}

/// A value that every format has, other at each point of a survey of up to 6 x 7 x 8 points.
pub(in crate::format) fn value(x: usize, y: usize, z: usize) -> f64 {
    (1 + x + 4 * y + 20 * z) as f64 % 127.0
}

impl TestFile {
    /// A survey of `dims` points with values by [`value`]; inline numbers are 100, 103, .., crossline numbers 20, 22, ...
    pub fn new(code: u16, is_little: bool, [nx, ny, nz]: [usize; 3]) -> Self {
        let trace = |y: usize, z: usize| Trace {
            inline: 100 + 3 * z as i32,
            crossline: 20 + 2 * y as i32,
            values: (0..nx).map(|x| value(x, y, z)).collect(),
            more: vec![],
        };
        let traces = (0..nz).flat_map(|z| (0..ny).map(move |y| trace(y, z))).collect();
        TestFile { code, is_little, text: vec![], more: vec![], line_bytes: [189, 193], more_headers: 0, traces }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut file = vec![0x40; 3200];
        file.resize(3600, 0);
        let samples = self.traces.first().map_or(0, |trace| trace.values.len());
        for (byte, size, number) in [(3217, 2, 4000), (3221, 2, samples as i64), (3225, 2, self.code.into())] {
            self.put(&mut file, byte, size, number);
        }
        self.more.iter().for_each(|&(byte, size, number)| self.put(&mut file, byte, size, number));
        file.extend_from_slice(&self.text);
        for trace in &self.traces {
            let start = file.len();
            file.resize(start + 240 * (1 + self.more_headers), 0);
            let header = &mut file[start..];
            self.put(header, self.line_bytes[0], 4, trace.inline.into());
            self.put(header, self.line_bytes[1], 4, trace.crossline.into());
            trace.more.iter().for_each(|&(byte, size, number)| self.put(header, byte, size, number));
            trace.values.iter().for_each(|&value| file.extend(self.sample(value)));
        }
        file
    }

    fn put(&self, bytes: &mut [u8], byte: usize, size: usize, number: i64) {
        let mut number = number.to_be_bytes()[8 - size..].to_vec();
        if self.is_little {
            number.reverse();
        }
        bytes[byte - 1..][..size].copy_from_slice(&number);
    }

    fn sample(&self, value: f64) -> Vec<u8> {
        let integer = |size: usize| (value as i64).to_be_bytes()[8 - size..].to_vec();
        let mut bytes = match self.code {
            1 => ibm_of(value).to_be_bytes().to_vec(),
            5 => (value as f32).to_be_bytes().to_vec(),
            6 => value.to_be_bytes().to_vec(),
            2 | 10 => integer(4),
            3 | 11 => integer(2),
            7 | 15 => integer(3),
            _ => integer(1),
        };
        if self.is_little {
            bytes.reverse();
        }
        bytes
    }

    pub fn open(&self, options: &SegyOptions) -> Result<SegyVolume, SegyError> {
        open(&self.bytes(), options)
    }

    /// What is wrong with it, in words.
    pub fn error(&self, options: &SegyOptions) -> String {
        error(&self.bytes(), options)
    }
}

pub(super) fn open(bytes: &[u8], options: &SegyOptions) -> Result<SegyVolume, SegyError> {
    SegyVolume::new(Input::Bytes(bytes.to_vec()), "a.sgy".into(), options, &Progress::new())
}

pub(super) fn error(bytes: &[u8], options: &SegyOptions) -> String {
    open(bytes, options).expect_err("it is not sound").to_string()
}

/// The IBM float nearest to a value.
fn ibm_of(value: f64) -> u32 {
    if value == 0.0 {
        return 0;
    }
    let exponent = (value.abs().log2() / 4.0).floor() as i32 + 1;
    let fraction = (value.abs() * 16f64.powi(6 - exponent)).round() as u32;
    u32::from(value < 0.0) << 31 | ((exponent + 64) as u32) << 24 | fraction
}
