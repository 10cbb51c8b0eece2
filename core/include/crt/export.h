/// Marks the exports of libcrt, and defines the namespace that carries the version of its interface.
#pragma once

#if defined(__GNUC__)
#define CRT_API __attribute__((visibility("default")))
#else
#define CRT_API
#endif

/// Everything lies in crt::v0, which programs see as crt: a library with another interface has other
/// symbols. libcrt itself keeps it apart from its own namespace crt.
#ifdef CRT_BUILDS_LIBRARY
#define CRT_API_NAMESPACE_BEGIN \
    namespace crt {             \
    namespace v0 {
#else
#define CRT_API_NAMESPACE_BEGIN \
    namespace crt {             \
    inline namespace v0 {
#endif
#define CRT_API_NAMESPACE_END \
    }                         \
    }
