// A plugin whose library is not installed: the dynamic linker refuses it before any of its code runs.
#include "backend/crt_backend.h"

int crtAbsent();

const CrtBackend* crt_backend_v1(void) {
    crtAbsent();  // the call is what makes the library necessary
    return nullptr;
}
