//! PNG files of opaque pixels (ISO/IEC 15948).
//!
//! Rows are not filtered, and compressed at the fastest level. Figures are mostly flat: their files grow by about a fifth, and
//! take a sixth of the time.

use miniz_oxide::deflate::compress_to_vec_zlib;

/// Level of compression, 0 to 10.
const LEVEL: u8 = 1;

/// A PNG file of `width` times `height` pixels, row by row from the top. Each pixel has four bytes: red, green, blue and an
/// opacity, which is left out. The file states how many pixels a metre has, if there is such a number.
pub(super) fn encode(width: u32, height: u32, per_metre: Option<u32>, pixels: &[u8]) -> Vec<u8> {
    let row_bytes = 4 * width as usize;
    let mut rows = Vec::with_capacity(pixels.len());
    for row in pixels.chunks_exact(row_bytes) {
        // No filter.
        rows.push(0);
        rows.extend(row.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]));
    }
    let mut header = Vec::new();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    // Eight bits per channel, RGB, the only methods of compression and filtering, no interlacing.
    header.extend([8, 2, 0, 0, 0]);
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    write_chunk(&mut file, b"IHDR", &header);
    if let Some(per_metre) = per_metre {
        // The same in both directions; 1 stands for the metre.
        let density = [&per_metre.to_be_bytes()[..], &per_metre.to_be_bytes(), &[1]].concat();
        write_chunk(&mut file, b"pHYs", &density);
    }
    write_chunk(&mut file, b"IDAT", &compress_to_vec_zlib(&rows, LEVEL));
    write_chunk(&mut file, b"IEND", &[]);
    file
}

/// Appends a chunk: length, kind, content, and a checksum of kind and content.
fn write_chunk(file: &mut Vec<u8>, kind: &[u8; 4], content: &[u8]) {
    file.extend((content.len() as u32).to_be_bytes());
    let checked = file.len();
    file.extend(kind);
    file.extend(content);
    let sum = crc32(&file[checked..]);
    file.extend(sum.to_be_bytes());
}

/// The CRC-32 of ISO 3309, with the reflected polynomial 0xEDB88320.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = table();
    !bytes.iter().fold(!0, |sum: u32, &byte| TABLE[(sum as u8 ^ byte) as usize] ^ (sum >> 8))
}

/// The remainders of single bytes.
const fn table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut sum = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            sum = if sum & 1 == 1 { 0xEDB8_8320 ^ (sum >> 1) } else { sum >> 1 };
            bit += 1;
        }
        table[byte] = sum;
        byte += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use miniz_oxide::inflate::decompress_to_vec_zlib;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // The standard check value of CRC-32, and the end of every PNG file.
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
        assert_eq!(crc32(b"IEND"), 0xAE42_6082);
    }

    #[test]
    fn pixels_come_back() {
        let pixels: Vec<u8> = (0..3 * 2 * 4).collect();
        let file = encode(3, 2, None, &pixels);
        let length = u32::from_be_bytes(file[33..37].try_into().expect("four bytes")) as usize;
        assert_eq!((&file[12..16], &file[37..41]), (&b"IHDR"[..], &b"IDAT"[..]));
        let rows = decompress_to_vec_zlib(&file[41..41 + length]).expect("compressed rows");
        assert_eq!(rows, [0, 0, 1, 2, 4, 5, 6, 8, 9, 10, 0, 12, 13, 14, 16, 17, 18, 20, 21, 22]);
        let on_paper = encode(3, 2, Some(23_622), &pixels);
        assert_eq!(on_paper[33..54], *b"\0\0\0\x09pHYs\0\0\x5C\x46\0\0\x5C\x46\x01\x14\x94\x43\x41");
        assert_eq!((&on_paper[..33], &on_paper[54..]), (&file[..33], &file[33..]));
        assert_eq!(file[41 + length + 4..], *b"\0\0\0\0IEND\xAE\x42\x60\x82");
    }
}
