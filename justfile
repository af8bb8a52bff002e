# Common calls; `just` lists them. Each is a plain cargo command that can be typed instead.

[private]
default:
    @just --list

# All tests
test:
    cargo test --workspace

# Format, lints and documentation, as CI checks them
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings
    RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps

# The paper's 120 contacts, into results/
study file='examples/zirconia.toml' out='results':
    cargo run --release -- study {{file}} --out {{out}}

# The simulator beside exact solutions, other codes and the paper, into docs/
validate *arguments='--full --out docs':
    cargo run --release -- validate {{arguments}}

# The README's picture
figure:
    cargo run --release -p bristle-report --example figure

# Benchmarks; `just bench contact` runs one group
bench filter='':
    cargo bench --bench speed -- {{filter}}

# Integrators by work and error, into docs/work_precision.csv and .svg
integrators:
    cargo bench --bench integrators

# Other codes beside Bristle, in one table; see benches/peers/README.md
peers *arguments:
    python3 benches/peers/run.py {{arguments}}

# Accept what the tests compute as the new snapshots; look at the difference before you commit it
snapshots:
    INSTA_UPDATE=always cargo test --workspace

# Everything that CI runs
ci:
    .ci/run
