# `cpack -G DEB` in the build folder: a Debian package of the installed tree, with the dependencies that
# dpkg-shlibdeps reads off the binaries. NVIDIA's driver and NVRTC are found where they are, or done without.
set(CPACK_PACKAGE_NAME crt)
set(CPACK_PACKAGE_VENDOR "crt")
set(CPACK_PACKAGE_CONTACT "crt maintainers <crt@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DESCRIPTION
  "crt renders scenes wavelength by wavelength, so that dispersion, measured materials and measured lamps
come out of the light transport itself. It runs on NVIDIA GPUs (CUDA), on processors (Embree) and on OpenCL
devices, and gives the same image, bit for bit, on each of them.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Python and its packages make the pages of crt converge and crt verify.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3, python3-jinja2, python3-matplotlib")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "pocl-opencl-icd, libcuda1, bash-completion")
set(CPACK_DEBIAN_COMPRESSION_TYPE
  zstd)  # xz takes twenty times as long for a tenth of the size of the meshes
set(CPACK_GENERATOR DEB)
include(CPack)
