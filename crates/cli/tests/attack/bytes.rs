//! Damage to the bytes of a file, whatever they mean.

use fastrand::Rng;

/// A change of bytes. The slice is another file to take bytes from.
type Change = fn(&mut Vec<u8>, &[u8], &mut Rng);

/// The changes, by name.
pub const CHANGES: [(&str, Change); 15] = [
    ("flip bit", |bytes, _, random| {
        if let Some(byte) = any(bytes, random) {
            *byte ^= 1 << random.u8(..8);
        }
    }),
    ("change digit", |bytes, _, random| {
        let digits: Vec<usize> = (0..bytes.len())
            .filter(|&at| bytes[at].is_ascii_digit())
            .collect();
        if let Some(&at) = random.choice(&digits) {
            bytes[at] = b'0' + random.u8(..10);
        }
    }),
    ("change byte", |bytes, _, random| {
        if let Some(byte) = any(bytes, random) {
            *byte = random.u8(..);
        }
    }),
    ("insert byte", |bytes, _, random| {
        bytes.insert(random.usize(..=bytes.len()), random.u8(..))
    }),
    ("insert control", |bytes, _, random| {
        let control = [0x1b, 0x07, 0x7f, 0x08, 0x0b, 0x0c, 0x0d][random.usize(..7)];
        bytes.insert(random.usize(..=bytes.len()), control);
    }),
    ("insert NUL", |bytes, _, random| {
        let at = random.usize(..=bytes.len());
        bytes.splice(at..at, vec![0; random.usize(1..600)]);
    }),
    ("delete", |bytes, _, random| {
        drop(bytes.drain(range(bytes.len(), random)))
    }),
    ("delete byte", |bytes, _, random| {
        if !bytes.is_empty() {
            bytes.remove(random.usize(..bytes.len()));
        }
    }),
    ("truncate", |bytes, _, random| {
        bytes.truncate(random.usize(..=bytes.len()))
    }),
    ("repeat", |bytes, _, random| {
        let range = range(bytes.len(), random);
        let copy = bytes[range.clone()].repeat(random.usize(1..4));
        bytes.splice(range.start..range.start, copy);
    }),
    ("splice", |bytes, other, random| {
        let (at, piece) = (random.usize(..=bytes.len()), range(other.len(), random));
        let tail = if random.bool() {
            at..at
        } else {
            at..bytes.len()
        };
        bytes.splice(tail, other[piece].iter().copied());
    }),
    ("CRLF", |bytes, _, _| {
        *bytes = bytes
            .iter()
            .flat_map(|&byte| {
                if byte == b'\n' {
                    vec![b'\r', b'\n']
                } else {
                    vec![byte]
                }
            })
            .collect();
    }),
    ("BOM", |bytes, _, random| {
        let at = if random.u8(..4) == 0 {
            random.usize(..=bytes.len())
        } else {
            0
        };
        bytes.splice(at..at, "\u{feff}".bytes());
    }),
    ("not UTF-8", |bytes, _, random| {
        let at = random.usize(..=bytes.len());
        let piece: &[u8] = [
            b"\xff".as_slice(),
            b"\xc3",
            b"\xed\xa0\x80",
            b"\xf8\x88\x80\x80\x80",
        ][random.usize(..4)];
        bytes.splice(at..at, piece.iter().copied());
    }),
    ("lines", |bytes, _, random| {
        let mut lines: Vec<Vec<u8>> = bytes
            .split_inclusive(|&byte| byte == b'\n')
            .map(<[u8]>::to_vec)
            .collect();
        if !lines.is_empty() {
            let (from, to) = (random.usize(..lines.len()), random.usize(..lines.len()));
            match random.u8(..3) {
                0 => drop(lines.remove(from)),
                1 => lines.swap(from, to),
                _ => lines.insert(to, lines[from].clone()),
            }
        }
        *bytes = lines.concat();
    }),
];

/// Changes bytes in one way, chosen at random. Returns its name.
pub fn change(bytes: &mut Vec<u8>, other: &[u8], random: &mut Rng) -> &'static str {
    let (name, change) = CHANGES[random.usize(..CHANGES.len())];
    change(bytes, other, random);
    name
}

fn any<'b>(bytes: &'b mut [u8], random: &mut Rng) -> Option<&'b mut u8> {
    if bytes.is_empty() {
        None
    } else {
        Some(&mut bytes[random.usize(..bytes.len())])
    }
}

/// A part of something of this length, short more often than long.
fn range(length: usize, random: &mut Rng) -> std::ops::Range<usize> {
    let start = random.usize(..=length);
    let longest = if random.bool() { 20 } else { length };
    start..start + random.usize(..=longest.min(length - start))
}
