// The library that is there when crt_backend_missing_library is linked and gone when it is loaded.
__attribute__((visibility("default"))) int crtAbsent() { return 1; }
