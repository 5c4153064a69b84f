# Sourced by test.sh, demo.sh and .ci/run: what all three begin with.

step() { printf '\n== %s  (%s s)\n' "$*" "$SECONDS"; }

# install_packages [PACKAGE...]: installs what packages.txt lists and is not there, and these. What
# the archive does not have, as Ubuntu has no chromium but as a snap, is named and left out.
install_packages() {
  local wanted missing=() absent=() found=() as_root=()
  mapfile -t wanted < <(grep -v -e '^#' -e '^$' packages.txt)
  for package in "${wanted[@]}" "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' ||
      missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  step "install ${missing[*]}"
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  for package in "${missing[@]}"; do
    if apt-cache show "$package" >/dev/null 2>&1; then found+=("$package")
    else absent+=("$package"); fi
  done
  [ ${#absent[@]} -eq 0 ] || step "not in this system's archive: ${absent[*]}"
  [ ${#found[@]} -eq 0 ] && return
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${found[@]}"
}

# build PRESET [TARGET...]: configures, and builds these targets or all. Where the archive has no
# Clang 19, as Ubuntu 22.04, the system's compiler does.
build() {
  step "build $1"
  local compiler=()
  command -v clang++-19 >/dev/null || compiler=(-DCMAKE_C_COMPILER=cc -DCMAKE_CXX_COMPILER=c++)
  local configure=(cmake --preset "$1" "${compiler[@]}")
  mkdir -p build
  # Where another compiler built, it begins anew.
  "${configure[@]}" >build/"$1".log 2>&1 ||
    { rm -rf "build/$1/CMakeCache.txt" "build/$1/CMakeFiles" && "${configure[@]}" >build/"$1".log 2>&1; } ||
    { cat build/"$1".log; return 1; }
  cmake --build --preset "$1" ${2:+--target "${@:2}"}
}
