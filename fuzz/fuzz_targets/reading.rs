//! What holds for every text that the reader of expression graphs is given.

use bristle_codegen::back::json::{from_json, to_json};
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;

/// A file that passes the reader can be written, emitted, evaluated and read again; one that does
/// not is an error.
///
/// # Panics
/// If it is otherwise.
pub fn check(text: &str) {
    let file = match from_json(text) {
        Ok(file) => file,
        Err(error) => {
            let message = error.to_string();
            assert!(
                message.chars().count() < 4000,
                "a message of {} bytes",
                message.len()
            );
            assert!(!message.chars().any(char::is_control), "{message:?}");
            return;
        }
    };
    for kernel in &file.kernels {
        assert_eq!(kernel.graph.validate(), Ok(()));
        let values = kernel
            .graph
            .evaluate(&vec![0.6; kernel.graph.symbols().len()]);
        assert_eq!(values.len(), kernel.graph.nodes().len());
    }
    let written =
        to_json(&file.kernels, &file.generator).expect("what is read has finite constants");
    let again = from_json(&written).expect("what is written can be read");
    let rewritten = to_json(&again.kernels, &again.generator).expect("it was written before");
    assert_eq!(written, rewritten);
    let origin = Origin {
        title: "A file.",
        maker: &file.generator,
        again: "cargo fuzz",
    };
    let source = emit(&file.kernels, origin).expect("what is read can be emitted");
    syn::parse_file(&source).expect("what is emitted is Rust");
}
