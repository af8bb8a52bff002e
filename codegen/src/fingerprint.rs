//! SHA-256 of texts and source files, by which a program identifies what its results depend on.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// SHA-256 in hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new().chain_update(bytes))
}

/// SHA-256 of all files at and below `paths`, by name and content, in hexadecimal digits.
///
/// A path is a file or a directory. Names are hashed as they are given, joined by `/`: relative
/// paths give the same hash wherever the sources are. The order of `paths` and of directory entries
/// does not matter.
///
/// # Errors
/// If a path does not exist or cannot be read. The message names it.
pub fn sources<P: AsRef<Path>>(paths: &[P]) -> io::Result<String> {
    let mut files = Vec::new();
    for path in paths {
        collect(path.as_ref(), &mut files)?;
    }
    let name = |file: &PathBuf| {
        file.components()
            .map(|part| part.as_os_str().to_string_lossy())
            .collect::<Vec<_>>()
            .join("/")
    };
    let mut files: Vec<(String, PathBuf)> =
        files.into_iter().map(|file| (name(&file), file)).collect();
    files.sort();
    files.dedup();
    let mut hash = Sha256::new();
    for (name, file) in files {
        let content = fs::read(&file).map_err(|error| at(&file, &error))?;
        // Lengths are hashed too, so that different files never give the same bytes.
        for part in [name.as_bytes(), &content] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    Ok(hexadecimal(hash))
}

/// Identifies what decides the results of the package being built: the code at and below `source`,
/// and the versions of `packages` in the lock file `lock`. Tells Cargo to run the build script
/// again if one of the two changes.
///
/// # Errors
/// As for [`locked`] and [`sources`].
pub fn code(source: &str, lock: &str, packages: &[&str]) -> io::Result<String> {
    for path in [source, lock]
        .into_iter()
        .filter(|path| Path::new(path).exists())
    {
        println!("cargo::rerun-if-changed={path}");
    }
    Ok(locked(Path::new(lock), packages)? + &sources(&[source])?)
}

/// The entries of `packages` in a `Cargo.lock`, with their versions; empty without such a file, as
/// outside of the repository.
///
/// # Errors
/// If the file cannot be read. The message names it.
pub fn locked(lock: &Path, packages: &[&str]) -> io::Result<String> {
    match fs::read_to_string(lock) {
        Ok(text) => {
            let is_wanted = |entry: &&str| {
                packages
                    .iter()
                    .any(|name| entry.contains(&format!("\nname = \"{name}\"\n")))
            };
            Ok(text.split("[[package]]").filter(is_wanted).collect())
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(String::new()),
        Err(error) => Err(at(lock, &error)),
    }
}

/// Appends the files at and below `path`.
fn collect(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if !fs::metadata(path)
        .map_err(|error| at(path, &error))?
        .is_dir()
    {
        files.push(path.to_owned());
        return Ok(());
    }
    for entry in fs::read_dir(path).map_err(|error| at(path, &error))? {
        collect(&entry?.path(), files)?;
    }
    Ok(())
}

fn at(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(
        error.kind(),
        format!("cannot read {}: {error}", path.display()),
    )
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_sha_256() {
        // printf abc | sha256sum
        assert_eq!(
            digest(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn every_change_of_the_sources_changes_their_hash() {
        let root = std::env::temp_dir().join(format!("bristle-sources-{}", std::process::id()));
        let write = |name: &str, content: &str| {
            let path = root.join(name);
            fs::create_dir_all(path.parent().expect("it is below the root"))
                .expect("the directory can be made");
            fs::write(path, content).expect("the file can be written");
        };
        let hash =
            || sources(&[root.join("src"), root.join("lib.rs")]).expect("the files can be read");
        write("lib.rs", "a");
        write("src/one.rs", "b");
        write("src/deep/er/two.rs", "c");
        write("notes.md", "d");
        let mut seen = vec![hash()];
        assert_eq!(
            sources(&[
                root.join("lib.rs"),
                root.join("src"),
                root.join("src/one.rs")
            ])
            .ok(),
            Some(hash())
        );
        write("notes.md", "outside of what is asked for");
        assert_eq!(hash(), seen[0]);
        let mut changed = |what: &str| {
            let hash = hash();
            assert!(!seen.contains(&hash), "{what}");
            seen.push(hash);
        };
        write("src/deep/er/two.rs", "C");
        changed("a content");
        write("src/three.rs", "");
        changed("an empty file");
        fs::rename(root.join("src/three.rs"), root.join("src/four.rs")).expect("it can be renamed");
        changed("a name");
        write("src/one.rs", "");
        write("lib.rs", "ab");
        changed("content that moves from one file to another");
        fs::remove_dir_all(&root).expect("the directory can be removed");
        let error = sources(&[root.join("lib.rs")])
            .expect_err("it is removed")
            .to_string();
        assert!(
            error.contains("lib.rs") && error.starts_with("cannot read"),
            "{error}"
        );
    }
}
