/*
 * crt_backend.h: the border between crt and a backend plugin. C99; the only header that a plugin must have.
 *
 * A plugin is one shared library, crt_backend_<name>.so, that exports exactly one symbol, `crt_backend_v1`,
 * returning a table. The host gives the plugin a table too, so that the plugin links nothing of crt. Nothing
 * crosses but the types below: no C++ type, exception, bool, long or size_t; nothing allocated on one side
 * is freed on the other.
 *
 * Versioning. Every struct begins with its own size. A minor revision only appends members; a reader uses a
 * member only if the writer's struct_size covers it. A change of meaning or order is a new major version and
 * a new symbol name. The layout hash covers kernel/dialect/layout.h, channels.h and features.h: the scene
 * blob is read as C structs, so it must be equal. Equal bits versions mean equal samples: it must
 * be equal too, or one image would hold samples of two renderers.
 *
 * Threads. Each function says who may call it: [owner thread] is the one thread at a time that uses an
 * integrator, [any thread] needs no care.
 */
#ifndef CRT_BACKEND_H
#define CRT_BACKEND_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CRT_ABI_MAJOR 1
#define CRT_ABI_MINOR 3 /* 1: CrtBackend::bits_version; 2: CrtBackend::brings, progress() during set_scene,
                           CRT_KERNEL_LEAN_ONLY; 3: CrtFilmView::splats */

/* The entry symbol carries the major version: a plugin of another major version simply does not have it. */
#define CRT_BACKEND_ENTRY crt_backend_v1
#define CRT_BACKEND_ENTRY_NAME "crt_backend_v1"

#if defined(__GNUC__)
#define CRT_EXPORT __attribute__((visibility("default")))
#else
#define CRT_EXPORT
#endif

typedef int32_t CrtStatus;
enum {
    CRT_OK = 0,
    CRT_CANCELLED = 1, /* progress() asked to stop; the film holds part of the range and must be discarded */
    CRT_INVALID_ARGUMENT = 2, /* the host broke this contract */
    CRT_NO_DEVICE = 3,        /* no usable device; last_error says why */
    CRT_OUT_OF_MEMORY = 4,    /* host or device memory */
    CRT_DEVICE_FAILED = 5,    /* the device or its driver failed while working */
    CRT_UNSUPPORTED = 6,      /* the scene needs something that this backend lacks */
    CRT_INTERNAL = 7          /* a bug in the plugin */
};

typedef int32_t CrtLogLevel;
enum { CRT_LOG_DEBUG = 0, CRT_LOG_INFO = 1, CRT_LOG_WARNING = 2, CRT_LOG_ERROR = 3 };

/* Functions of the host. Lives at least as long as every integrator created with it. */
typedef struct CrtHost {
    uint32_t struct_size;
    uint16_t abi_major, abi_minor;
    void *user; /* first argument of the functions below */
    /* One line, no newline. [any thread] */
    void (*log)(void *user, CrtLogLevel level, const char *message);
    /* `done` in [0,1] of the running render call. Non-zero: stop soon and return CRT_CANCELLED. Since 1.2
       set_scene may call it too, to say how far it is; what it returns then may be ignored. [any thread] */
    int32_t (*progress)(void *user, double done);
    /* Directory for compiled kernels, existing and writable, or null when caching is off. */
    const char *cache_directory;
    /* Text of a kernel header ("kernel/schedule/pixel.h") with its includes expanded, or null when the
       name is unknown. Lives as long as the host. This is the same text for every backend: it may be
       compiled as C++17, CUDA C++ or OpenCL C 1.2. [any thread] */
    const char *(*kernel_source)(void *user, const char *name);
} CrtHost;

/* One device that a backend can use. Filled by probe(). */
typedef struct CrtDevice {
    uint32_t struct_size; /* set by the host before the call */
    uint32_t index;       /* stable within one machine and driver: what --device takes */
    char name[128];
    char driver[128];
    uint64_t memory_bytes; /* 0 when unknown */
    double score; /* higher is preferred; a CPU is about its number of threads, a GPU a few thousand */
} CrtDevice;

/* The kernel that the backend should run. */
typedef int32_t CrtKernelChoice;
enum {
    CRT_KERNEL_LEAN = 0, /* the smallest that covers the scene's features (default) */
    CRT_KERNEL_FULL = 1, /* everything compiled in: the same bits, only slower; used to prove that */
    CRT_KERNEL_LEAN_ONLY =
        2 /* since 1.2: lean from the first sample on, even if it must be compiled first: for measurements. A
             backend that runs no other kernel meanwhile need not know it: whatever is not FULL is lean. */
};

typedef struct CrtCreateInfo {
    uint32_t struct_size;
    uint32_t threads;         /* host threads to use; 0 means all */
    const char *device;       /* null or "" for the best; else an index or a part of a device name */
    CrtKernelChoice kernel;
    uint32_t tile_size;       /* hint, pixels; 0 means the backend's own. Never changes the image. */
} CrtCreateInfo;

/* The compiled scene: kernel/dialect/layout.h read from the first byte of `data`, 64-byte aligned;
   pointer-free. */
typedef struct CrtSceneBlob {
    uint32_t struct_size;
    uint32_t reserved;
    const void *data;
    uint64_t size_bytes;
} CrtSceneBlob;

/* Samples [first_sample, first_sample + sample_count) of the pixels [x0,x1) × [y0,y1), film coordinates. */
typedef struct CrtRenderRange {
    uint32_t struct_size;
    uint32_t x0, y0, x1, y1;
    uint32_t reserved;
    uint64_t first_sample;
    uint64_t sample_count;
} CrtRenderRange;

/*
 * The film, read back into the host's arrays. Row-major, top row first, width × height pixels of the whole
 * crop window. sums: [height][width][channels][2], each pair an unevaluated sum hi + lo of doubles (so that
 * order does not show). counts: [height][width], valid samples; an invalid (NaN or infinite) sample is
 * dropped and not counted. primitives: [height][width], primitive id at the first sample rendered,
 * 0xffffffff for none; null unless the scene requests it. splats: since 1.3; [height][width] pixels of
 * CRT_SPLAT_WORDS words (kernel/dialect/channels.h); null unless the scene's aovs have CRT_AOV_SPLATS.
 */
typedef struct CrtFilmView {
    uint32_t struct_size;
    uint32_t width, height, channels;
    double *sums;
    uint64_t *counts;
    uint32_t *primitives;
    uint64_t *splats;
} CrtFilmView;

/* Report of the backend's work. Times in seconds; zero where it does not apply. */
typedef struct CrtBackendReport {
    uint32_t struct_size;
    uint32_t kernel_from_cache;  /* 1 when the kernel came from a disk cache */
    char device[128];
    char kernel[128]; /* which kernel ran, in words, e.g. "nvrtc sm_90" or "precompiled: bvh, diffuse" */
    uint64_t kernel_features;    /* mask compiled into it */
    double compile_seconds;
    double cache_seconds;        /* looking up, reading and writing the cache */
    double build_seconds;        /* acceleration structure */
    double upload_seconds;
    double render_seconds;       /* summed over render calls, on the device where it can tell */
    uint64_t paths, closest_rays, shadow_rays;
    uint64_t peak_memory_bytes;  /* device memory in use at most; 0 when it is host memory */
    uint32_t registers;          /* per thread; 0 unless known */
    uint32_t spill_bytes;        /* per thread */
} CrtBackendReport;

typedef struct CrtIntegratorState CrtIntegratorState; /* the plugin's own */

/* The verbs of one integrator. All [owner thread]; render blocks. Every call may be refused with a status,
   and then last_error gives one sentence, valid until the next call. */
typedef struct CrtIntegrator {
    uint32_t struct_size;
    uint32_t reserved;
    CrtIntegratorState *state;
    /* Copies what it needs of the blob; clears the film. */
    CrtStatus (*set_scene)(CrtIntegratorState *state, const CrtSceneBlob *scene);
    /* ADDS a sample range to the film. Any order, any split of ranges and rectangles gives the same film. */
    CrtStatus (*render)(CrtIntegratorState *state, const CrtRenderRange *range);
    CrtStatus (*read_film)(CrtIntegratorState *state, const CrtFilmView *film);
    CrtStatus (*get_report)(CrtIntegratorState *state, CrtBackendReport *report);
    const char *(*last_error)(CrtIntegratorState *state);
    void (*destroy)(CrtIntegratorState *state);
} CrtIntegrator;

/*
 * Data structures that the backend builds itself instead of the host: bits of CrtBackend::brings.
 *
 * CRT_BRINGS_ACCELERATOR: it finds hits with an acceleration structure of its own wherever the scene says
 * CRT_ACCELERATOR_BVH, for every ray whose origin lies within accelerator_reach of 0 on each axis (lengths
 * as in the blob: the scene lies within 1). A scene whose rays all start there may then come without a BVH:
 * CrtScene::nodes is empty, and the slots of triangles are in the order of their ids. A scene whose camera
 * stands farther away comes with nodes.
 */
#define CRT_BRINGS_ACCELERATOR ((uint64_t)1)

/* The table behind the entry symbol. Static; lives as long as the library, which is never unloaded. */
typedef struct CrtBackend {
    uint32_t struct_size;
    uint16_t abi_major, abi_minor;
    uint64_t layout_hash; /* CRT_LAYOUT_HASH of the headers it was built with */
    const char *name;     /* as in crt_backend_<name>.so */
    const char *version;
    const char *build;    /* compiler and libraries, for humans */
    uint64_t features;    /* mask of kernel/dialect/features.h that it can run */
    /* Lists devices: writes at most `capacity`, sets *count to how many there are. No device is a normal
       answer: CRT_NO_DEVICE with a one-sentence reason in `reason` (NUL-terminated, cut to reason_size).
       Quick; touches no kernel. [any thread] */
    CrtStatus (*probe)(const CrtHost *host, CrtDevice *devices, uint32_t capacity, uint32_t *count,
                       char *reason, uint32_t reason_size);
    /* Opens a device. On failure *integrator is untouched and `reason` says why. [any thread] */
    CrtStatus (*create)(const CrtHost *host, const CrtCreateInfo *info, CrtIntegrator *integrator,
                        char *reason, uint32_t reason_size);
    /* Since 1.1: CRT_BITS_VERSION (kernel/dialect/bits_version.h) of the headers it was built with. Without
       it: 1. */
    uint32_t bits_version;
    uint32_t reserved;
    /* Since 1.2: bits of CRT_BRINGS_…, and what belongs to them. Without it: nothing. */
    uint64_t brings;
    double accelerator_reach; /* with CRT_BRINGS_ACCELERATOR: at least 1 */
} CrtBackend;

typedef const CrtBackend *(*CrtBackendEntry)(void);

/* Exported by every plugin. */
CRT_EXPORT const CrtBackend *crt_backend_v1(void);

#ifdef __cplusplus
}
#endif
#endif
