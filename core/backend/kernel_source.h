/// The kernel headers as texts, for backends that compile while they run. Embedded in the program
/// (cmake/EmbedKernels.cmake), or read from the directory CRT_KERNEL_DIR instead, to change a kernel without
/// building anything.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace crt {

/// One embedded header.
struct KernelFile {
    const char* name;         ///< As it is included: "kernel/geometry/ray.h".
    std::size_t begin, size;  ///< Its bytes among those of all headers.
};
extern const KernelFile kKernelFiles[];
extern const std::size_t kKernelFileCount;
/// The bytes of all headers, one after the other, packed by zstd.
extern const unsigned char kPackedKernels[];
extern const std::size_t kPackedKernelsSize;

/// Text of a kernel header ("kernel/schedule/wavefront.h") with its quoted includes expanded, or null when
/// there is none of that name. Lives as long as the process. Throws crt::Error(Internal) when an include
/// names a header that does not exist, crt::Error(Backend) when CRT_KERNEL_DIR holds another of the headers
/// that the layout hash covers than this program was built with: the kernel would misread the scene. [any
/// thread]
const char* kernelSource(const std::string& name);

/// The expansion itself: `text_of` gives a header's text or nothing. An include that is certain to be
/// compiled (only the header's own guard around it) is expanded once and dropped after that; one that
/// depends on a condition is expanded wherever it stands, for the first of two may be the one that is left
/// out. Includes in angle brackets are left alone.
std::string expandIncludes(const std::string& name,
                           const std::function<std::optional<std::string>(const std::string&)>& text_of);

}  // namespace crt
