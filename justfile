# Common commands; `just` lists them. Each runs a plain command that you can type instead.

[private]
default:
    @just --list

# Run the tests, but for those that take minutes
test:
    cargo test --workspace

# Check format, lints, layers and documentation
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings
    cargo clippy --workspace --all-targets --features bristle-cli/parquet,bristle-cli/vtk -- -D warnings
    .ci/layers
    RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps

# Check workflows, templates and citation by their JSON schemas
schemas:
    .ci/schemas

# Make and build the packages of the published crates
packages:
    .ci/packages

# Check licences, duplicates and advisories of dependencies; needs cargo-deny
deny:
    cargo deny check

# Install the Python package in target/python, and test it there
python:
    mkdir -p target/python
    test -x target/python/environment/bin/python || python3 -m venv target/python/environment
    target/python/environment/bin/python -m pip install --quiet './python[notebooks,test]'
    rm -rf target/python/tests
    cp -r python/tests docs/python.md python/pyproject.toml target/python
    cp python/README.md target/python/readme.md
    cd target/python && environment/bin/python -m mypy -p bristle
    cd target/python && environment/bin/python -m mypy tests
    cd target/python && environment/bin/python -m pytest --quiet --doctest-modules --pyargs bristle
    cd target/python && environment/bin/python -m pytest --quiet tests python.md readme.md --doctest-glob='*.md'

# Derive committed graphs and references again, and evaluate the equations in Octave, NumPy and SymPy
equations:
    .ci/equations

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
