#!/usr/bin/env bash
# Installs what is missing, then runs every check: format, lints, documentation, tests. No GPU is needed; without any
# Vulkan device the tests fail instead of being skipped.
#
#   ci/test.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

ci/setup.sh
PATH=$HOME/.cargo/bin:$PATH

cargo fmt --check
cargo clippy --locked --all-targets -- -D warnings
RUSTDOCFLAGS='-D warnings' cargo doc --locked --no-deps --quiet
VITRUM_REQUIRE_DEVICE=1 cargo test --locked
