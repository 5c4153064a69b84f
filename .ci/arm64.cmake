# Toolchain for arm64 (Raspberry Pi 5, Jetson, RK3588) on any other Debian 12; the preset arm64 uses it.
# Libraries and headers come from the sysroot that `.ci/arm64 sysroot` makes of Debian's packages.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

if(NOT DEFINED CREPES_ARM64_SYSROOT)
  if(DEFINED ENV{CREPES_ARM64_SYSROOT})
    set(CREPES_ARM64_SYSROOT $ENV{CREPES_ARM64_SYSROOT})
  elseif(DEFINED ENV{XDG_CACHE_HOME})
    set(CREPES_ARM64_SYSROOT $ENV{XDG_CACHE_HOME}/crepes/arm64)
  else()
    set(CREPES_ARM64_SYSROOT $ENV{HOME}/.cache/crepes/arm64)
  endif()
endif()
set(CREPES_ARM64_SYSROOT ${CREPES_ARM64_SYSROOT} CACHE PATH "Debian's arm64 packages, unpacked")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CREPES_ARM64_SYSROOT)
if(NOT EXISTS ${CREPES_ARM64_SYSROOT}/complete)
  message(FATAL_ERROR "No sysroot in ${CREPES_ARM64_SYSROOT}: run .ci/arm64 sysroot")
endif()

set(CMAKE_SYSROOT ${CREPES_ARM64_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)

# Runs what was built, for the manuals and the tests; the kernel need not know of it (binfmt).
find_program(QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static)
if(QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${QEMU_AARCH64};-L;${CMAKE_SYSROOT})
endif()

# The package: dpkg-shlibdeps looks libraries up here, and DPKG_ADMINDIR says whose they are.
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu)
