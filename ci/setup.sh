#!/usr/bin/env bash
# Installs what Vitrum needs and the machine lacks; run again, it changes nothing.
#
#   ci/setup.sh
#
# On Debian and Ubuntu: the Vulkan loader, the validation layer, lavapipe (with ray query, from the backports suite
# where the release's own is older), a C++ toolchain, shaderc, Xvfb and, where apt has it, rustup.
# On other systems it says what is missing. Everything goes through apt; the mirror is the one that apt already uses.
#
# shaderc ends up as one whole library in a cache ($VITRUM_CACHE, by default ~/.cache/vitrum) that outlives the checkout;
# .native/shaderc in the checkout points there, and .cargo/config.toml points cargo at .native/shaderc. Two more drivers
# for the tests are unpacked there too, not installed.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cache=${VITRUM_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/vitrum}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

say() { printf 'setup: %s\n' "$*"; }
fail() { printf 'setup: %s\n' "$*" >&2; exit 1; }

# ---- packages -------------------------------------------------------------------------------------------------------

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"
    elif command -v sudo >/dev/null; then sudo "$@"
    else fail "needs root for: $* (no sudo here; run it as root once)"
    fi
}

installed() { dpkg-query -W -f '${Status}' "$1" 2>/dev/null | grep -q '^install ok installed'; }

# Indices are refreshed once, and only when something has to be installed.
refresh() {
    [ -n "${refreshed-}" ] && return
    as_root apt-get update -qq || say "apt-get update reported errors; going on with what it has"
    refreshed=1
}

install() { # [apt options] packages: those that are missing
    local options=() missing=() word
    for word; do
        case $word in
            -*) options+=("$word") ;;
            *) installed "$word" || missing+=("$word") ;;
        esac
    done
    [ ${#missing[@]} = 0 ] && return
    refresh
    say "installing ${missing[*]}"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        "${options[@]}" "${missing[@]}" >"$work/apt.log" 2>&1 || { tail -n 20 "$work/apt.log" >&2; fail "apt-get could not install ${missing[*]}"; }
}

# ---- lavapipe -------------------------------------------------------------------------------------------------------

# The first Mesa whose lavapipe has VK_KHR_ray_query.
ray_query_mesa=24.2

lavapipe_has_ray_query() {
    installed mesa-vulkan-drivers &&
        dpkg --compare-versions "$(dpkg-query -W -f '${Version}' mesa-vulkan-drivers)" ge "$ray_query_mesa"
}

# Debian's backports suite comes from the mirror that already serves the release itself.
enable_backports() {
    local codename=$1 mirror
    apt-cache policy | grep "n=$codename-backports" >/dev/null && return
    mirror=$(apt-get indextargets --format '$(CODENAME) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' |
        awk -v c="$codename" '$1 == c && $2 == "main" { print $3; exit }')
    [ -n "$mirror" ] || return 1
    say "enabling $codename-backports"
    printf 'Types: deb\nURIs: %s\nSuites: %s-backports\nComponents: main\nSigned-By: /usr/share/keyrings/debian-archive-keyring.gpg\n' \
        "$mirror" "$codename" | as_root tee "/etc/apt/sources.list.d/$codename-backports.sources" >/dev/null
    refreshed=
    refresh
}

install_lavapipe() {
    lavapipe_has_ray_query && return
    local id codename candidate
    id=$(. /etc/os-release && printf '%s' "$ID")
    codename=$(. /etc/os-release && printf '%s' "${VERSION_CODENAME-}")
    refresh
    candidate=$(apt-cache policy mesa-vulkan-drivers | awk '/Candidate:/ { print $2 }')
    if [ "$id" = debian ] && dpkg --compare-versions "$candidate" lt "$ray_query_mesa" && enable_backports "$codename"; then
        say "installing lavapipe from $codename-backports"
        if as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
            -t "$codename-backports" mesa-vulkan-drivers >"$work/apt.log" 2>&1; then
            return
        fi
        tail -n 5 "$work/apt.log" >&2
        say "backports has no usable Mesa; taking the release's own"
    fi
    install mesa-vulkan-drivers
    lavapipe_has_ray_query || say "this lavapipe has no ray query: hardware ray tracing cannot be tested here"
}

# ---- shaderc --------------------------------------------------------------------------------------------------------

# Links a small program against the shaderc in folder $1 and compiles a shader with it: an underlinked library fails here.
shaderc_works() {
    local folder=$1
    shift
    cat >"$work/probe.c" <<'C'
#include <string.h>
enum { COMPUTE = 2 };
void *shaderc_compiler_initialize(void);
void *shaderc_compile_into_spv(void *, const char *, size_t, int, const char *, const char *, void *);
int shaderc_result_get_compilation_status(void *);
int main(void) {
    const char *source = "#version 460\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
    void *result = shaderc_compile_into_spv(shaderc_compiler_initialize(), source, strlen(source), COMPUTE, "probe", "main", 0);
    return result == 0 || shaderc_result_get_compilation_status(result) != 0;
}
C
    cc "$work/probe.c" -o "$work/probe" -L"$folder" "$@" -lstdc++ -lm -lpthread >"$work/probe.log" 2>&1 && "$work/probe"
}

# Debian ships shaderc without its half of glslang. Joined with the archives that it leaves out, it is whole.
join_archives() {
    local from=$1 to=$2 name
    [ -f "$from/libshaderc_combined.a" ] || return 1
    {
        printf 'create %s\n' "$to/libshaderc_combined.a"
        for name in shaderc_combined glslang MachineIndependent GenericCodeGen OGLCompiler OSDependent SPIRV SPIRV-Tools-opt SPIRV-Tools; do
            [ -f "$from/lib$name.a" ] && printf 'addlib %s\n' "$from/lib$name.a"
        done
        printf 'save\nend\n'
    } | ar -M >/dev/null 2>&1 && shaderc_works "$to" -lshaderc_combined
}

# The sources that the shaderc-sys crate carries: more than ten minutes of processor time, once a machine.
build_shaderc() {
    local to=$1 source
    install cmake ninja-build git python3
    source=$(cd "$root" && cargo metadata --format-version 1 --locked | tr ',' '\n' |
        sed -n 's|.*"manifest_path":"\(.*/shaderc-sys-[^/]*\)/Cargo.toml".*|\1|p' | head -n 1)
    [ -d "$source/build" ] || fail "the sources of shaderc-sys are not where cargo says: '$source'"
    say "building shaderc from source (some ten minutes, once)"
    cmake -S "$source/build" -B "$work/shaderc" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
        -DENABLE_GLSLANG_BINARIES=OFF -DSHADERC_SKIP_TESTS=ON -DSPIRV_SKIP_EXECUTABLES=ON -DSPIRV_WERROR=OFF >"$work/cmake.log" 2>&1 &&
        cmake --build "$work/shaderc" --target shaderc_combined-pkg-config shaderc_combined >>"$work/cmake.log" 2>&1 ||
        { tail -n 20 "$work/cmake.log" >&2; fail "shaderc did not build"; }
    cp "$(find "$work/shaderc" -name libshaderc_combined.a | head -n 1)" "$to/"
    shaderc_works "$to" -lshaderc_combined || fail "the shaderc that was built does not link"
}

install_shaderc() {
    local packages folder version kept
    packages=(libshaderc-dev glslang-dev spirv-tools)
    install "${packages[@]}"
    version=$(dpkg-query -W -f '${Package}-${Version}_' "${packages[@]}" | cksum | cut -d' ' -f1)
    folder=/usr/lib/$(cc -print-multiarch)
    kept=$cache/shaderc-$version
    if [ ! -e "$kept/complete" ]; then
        mkdir -p "$kept"
        if join_archives "$folder" "$kept"; then
            say "shaderc: joined from the distribution's archives"
        elif rm -f "$kept/libshaderc_combined.a"; shaderc_works "$folder" -lshaderc; then
            ln -sf "$folder/libshaderc.so" "$kept/"
            say "shaderc: the distribution's shared library"
        else
            build_shaderc "$kept"
        fi
        touch "$kept/complete"
    fi
    mkdir -p "$root/.native"
    ln -sfn "$kept" "$root/.native/shaderc"
}

# ---- other drivers --------------------------------------------------------------------------------------------------

# Unpacks the library and the manifest of a driver into the cache, beside what is installed: package[/suite], a pattern for
# the files, a name. .native/drivers/NAME.json is then for VK_DRIVER_FILES.
unpack_driver() {
    local package=$1 pattern=$2 name=$3 deb kept manifest library
    deb=$(apt-get download --print-uris "$package" 2>/dev/null | awk '{ print $2; exit }')
    [ -n "$deb" ] || { say "no package $package here: tests on $name are left out"; return; }
    kept=$cache/drivers/${deb%.deb}
    if [ ! -e "$kept/complete" ]; then
        say "fetching the driver $name"
        (cd "$work" && apt-get download -qq "$package" >/dev/null 2>&1) || { say "cannot download $package: tests on $name are left out"; return; }
        rm -rf "$kept"
        mkdir -p "$kept"
        dpkg-deb --fsys-tarfile "$work"/"${package%%/*}"_*.deb | tar -x -C "$kept" --wildcards "$pattern"
        touch "$kept/complete"
    fi
    library=$(find "$kept" -name '*.so' | head -n 1)
    manifest=$(find "$kept" -name '*.json' ! -name '*i686*' | head -n 1)
    if [ -z "$library" ] || [ -z "$manifest" ] || ldd "$library" | grep -q 'not found'; then
        say "$name does not load here: tests on it are left out"
        return
    fi
    sed 's|"library_path": *"[^"]*"|"library_path": "'"$library"'"|' "$manifest" >"$root/.native/drivers/$name.json"
}

# Two more software drivers, so that pictures are held against each other: lavapipe of the release itself, which has no ray
# query where that is old, and the SwiftShader that Chromium carries.
install_drivers() {
    mkdir -p "$root/.native/drivers"
    rm -f "$root"/.native/drivers/*.json
    local codename
    codename=$(. /etc/os-release && printf '%s' "${VERSION_CODENAME-}")
    refresh_unless_known chromium-common
    unpack_driver "mesa-vulkan-drivers/$codename" '*lvp*' lavapipe-of-release
    unpack_driver chromium-common '*vk_swiftshader*' swiftshader
}

refresh_unless_known() { apt-cache show "$1" >/dev/null 2>&1 || refresh; }

# ---- Rust -----------------------------------------------------------------------------------------------------------

install_rust() {
    [ -x "$HOME/.cargo/bin/cargo" ] && PATH=$HOME/.cargo/bin:$PATH
    if ! command -v cargo >/dev/null; then
        refresh
        apt-cache show rustup >/dev/null 2>&1 || fail "no cargo on this machine and no rustup package: install Rust with rustup, then run this again"
        install rustup
        rustup default stable
    fi
    local wanted have
    wanted=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' "$root/Cargo.toml")
    have=$(cargo --version | cut -d' ' -f2)
    dpkg --compare-versions "$have" ge "$wanted" || fail "cargo is $have; Vitrum needs $wanted or newer: run 'rustup update'"
}

# ---- all of it ------------------------------------------------------------------------------------------------------

if ! command -v apt-get >/dev/null; then
    cat >&2 <<'TEXT'
setup: no apt-get here. Vitrum needs, from this system's own packages:
  - Rust (rustup), a C++ compiler
  - shaderc with its static library; put its folder into SHADERC_LIB_DIR ("$VULKAN_SDK/lib" with the Vulkan SDK),
    or leave it out and have cmake, git and python3: cargo then builds shaderc, once, in some ten minutes
  - the Vulkan loader and a driver (lavapipe, or a GPU's; MoltenVK on macOS), and for tests VK_LAYER_KHRONOS_validation
TEXT
    exit 1
fi

install build-essential pkg-config ca-certificates libvulkan1 vulkan-validationlayers xvfb \
    libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0
install_lavapipe
install_rust
install_shaderc
install_drivers
say "ready"
