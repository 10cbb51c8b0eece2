/// The kernel with everything in, compiled by nvcc with the plugin.
#pragma once

namespace crt::cuda {

/// A fat binary: machine code for the architectures of CRT_CUDA_ARCHITECTURES, and PTX for newer ones.
extern "C" const unsigned char kPrecompiledKernels[];

}  // namespace crt::cuda
