#!/usr/bin/env bash
# Installs what is missing, builds Vitrum and renders the built-in scene.
#
#   ci/demo.sh [OUT.png] [options of vitrum render]
set -euo pipefail
here=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."

ci/setup.sh
PATH=$HOME/.cargo/bin:$PATH
cargo build --locked --release
vitrum=$PWD/target/release/vitrum
cd "$here"
"$vitrum" render -o "${1:-glass.png}" "${@:2}"
