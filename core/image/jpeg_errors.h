/// The handler of libjpeg's errors: it jumps back to the caller, with a sentence. Included by the reader and
/// the writer of JPEG alone.
#pragma once

#include <csetjmp>
#include <cstdio>

#include <jpeglib.h>

namespace crt::image {

struct JpegErrors {
    jpeg_error_mgr manager;  // First: libjpeg knows the address of this alone.
    std::jmp_buf escape;
    char sentence[JMSG_LENGTH_MAX] = {};
};

[[noreturn]] inline void failJpeg(j_common_ptr codec) {
    auto* const errors = reinterpret_cast<JpegErrors*>(codec->err);
    codec->err->format_message(codec, errors->sentence);
    std::longjmp(errors->escape, 1);
}

}  // namespace crt::image
