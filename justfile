# Common commands; `just` lists them. Each runs a plain command that you can type instead.

[private]
default:
    @just --list

# Run the tests, but for those that take minutes
test:
    cargo test --workspace

# Check format, lints and documentation, as CI does
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings
    RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps

# Simulate the paper's 120 contacts, into results/
study file='examples/zirconia.toml' out='results':
    cargo run --release -- study {{file}} --out {{out}}

# Compare the simulator with exact solutions, other codes and the paper, into target/validation/
validate *arguments='--full':
    cargo test --release -p bristle-validation -- {{arguments}}

# Build the documents as a site, in target/site; `just site serve` shows it
site *arguments:
    docs/site/run {{arguments}}

# Draw so many random input files and calls instead of those of the tests
properties cases='20000' seed='7':
    PROPTEST_CASES={{cases}} PROPTEST_RNG_SEED={{seed}} cargo test --release -p bristle-cli --test cli -- random_input::

# Fuzz a reader on the installed compiler; see fuzz/README.md
fuzz target='graph' seconds='60':
    fuzz/run {{target}} {{seconds}}

# Simulate pairs of random brushes that must have the same results, so many times as many as the tests do
agreement times='100' seed='1':
    cargo test --release -p bristle --test agreement -- --times {{times}} --seed {{seed}}

# Run benchmarks; `just bench contact` runs one group
bench filter='':
    cargo bench --bench speed -- {{filter}}

# Compare other codes with Bristle in one table; see benches/peers/README.md
peers *arguments:
    python3 benches/peers/run.py {{arguments}}

# Accept new snapshots; check the differences before you commit them
snapshots:
    INSTA_UPDATE=always cargo test --workspace

# Run everything that CI runs
ci:
    .ci/run
