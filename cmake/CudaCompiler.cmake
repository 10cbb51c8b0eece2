# nvcc, cuda.h and their version: all that crt needs of a CUDA toolkit to build.
#
# Not find_package(CUDAToolkit): that of CMake 3.25 stops with an error at a toolkit that has no nvToolsExt,
# as a CUDA 13 made of nvcc, NVRTC and the run-time headers alone.
#
#   CRT_NVCC              path of nvcc
#   CRT_CUDA_INCLUDE_DIR  folder of cuda.h
#   CRT_CUDA_VERSION      e.g. 13.0
#
# -DCUDAToolkit_ROOT=<dir>, then CUDA_HOME, CUDA_PATH, PATH and /usr/local/cuda say where to look.
find_program(CRT_NVCC nvcc HINTS ${CUDAToolkit_ROOT} ENV CUDA_HOME ENV CUDA_PATH PATHS /usr/local/cuda
  PATH_SUFFIXES bin)
if(CRT_NVCC)
  get_filename_component(nvcc_real ${CRT_NVCC} REALPATH)
  get_filename_component(nvcc_root ${nvcc_real}/../.. ABSOLUTE)
  find_path(CRT_CUDA_INCLUDE_DIR cuda.h HINTS ${nvcc_root} PATH_SUFFIXES include
    targets/x86_64-linux/include)
  execute_process(COMMAND ${CRT_NVCC} --version OUTPUT_VARIABLE nvcc_text ERROR_QUIET)
  if(nvcc_text MATCHES "release ([0-9]+\\.[0-9]+)")
    set(CRT_CUDA_VERSION ${CMAKE_MATCH_1})
  endif()
endif()
