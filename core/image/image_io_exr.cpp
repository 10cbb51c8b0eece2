// The image module that writes EXR, through OpenEXR, behind image_module.h. Nothing else in crt uses it.
#include "image/exr_writer.h"
#include "image/image_module.h"
#include "image/module_support.h"

#include <OpenEXR/OpenEXRConfig.h>

namespace {

std::int32_t writeFile(const char* path, const CrtImagePlanes* image, char* reason,
                       std::uint32_t reason_size) {
    return crt::image::guarded(reason, reason_size, [&] { crt::image::writeExr(path, *image); });
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void);

extern "C" const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void) {
    static const CrtImageModule table{sizeof(CrtImageModule),
                                      0,
                                      "OpenEXR " OPENEXR_VERSION_STRING,
                                      writeFile,
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      nullptr};
    return &table;
}
