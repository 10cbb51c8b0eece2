/*
 * image_module.h: the border between crt and its three image codec modules. C99.
 *
 *   lib/crt/crt_image_plain.so   PNG, JPEG, Radiance HDR and TGA, with three small libraries
 *   lib/crt/crt_image_exr.so     writes EXR, with OpenEXR
 *   lib/crt/crt_image_oiio.so    reads EXR, with OpenImageIO and the 250 libraries that it brings
 *
 * Only a job that reads or writes such a file pays for them.
 *
 * A module exports one symbol, which returns a table. No C++ type and no exception crosses; what the
 * module allocates the module frees. Functions return 0, or non-zero with one sentence in `reason`
 * (NUL-terminated, cut to reason_size). [any thread]
 */
#ifndef CRT_IMAGE_MODULE_H
#define CRT_IMAGE_MODULE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CRT_IMAGE_PLAIN_FILE "crt_image_plain.so"
#define CRT_IMAGE_EXR_WRITER_FILE "crt_image_exr.so"
#define CRT_IMAGE_EXR_READER_FILE "crt_image_oiio.so"
/* The symbol carries the version: a module of another version does not have it. */
#define CRT_IMAGE_MODULE_ENTRY crt_image_module_v8
#define CRT_IMAGE_MODULE_ENTRY_NAME "crt_image_module_v8"

typedef struct CrtImageText {
    const char *name;
    const char *value;
} CrtImageText;

/* Properties of the pixels that a file states and crt does not apply; 0: none. */
typedef struct CrtUnappliedTags {
    float gamma;               /* PNG: gAMA, unless sRGB, iCCP or cICP overrides it */
    float exposure;            /* Radiance HDR: what its pixels were multiplied by */
    float color_correction[3]; /* Radiance HDR: what red, green and blue were multiplied by */
    float chromaticities[8]; /* PNG: cHRM as {Rx, Ry, …, Wx, Wy}, unless sRGB, iCCP or cICP overrides it */
    uint32_t code_points;    /* PNG: cICP, its four bytes, primaries first */
    uint32_t orientation;    /* JPEG and PNG: EXIF, 1 to 8; 1 is as the pixels lie */
    char profile[64];        /* JPEG and PNG: the name of an ICC profile of other colours than sRGB */
} CrtUnappliedTags;

/* Pixels row-major, top row first. */
typedef struct CrtImagePlanes {
    uint32_t width, height;
    uint32_t float_channel_count, integer_channel_count;
    const char *const *float_channels; /* names */
    const char *const *integer_channels;
    const float *floats;               /* [height][width][float_channel_count] */
    const uint32_t *integers;          /* [height][width][integer_channel_count] */
    const CrtImageText *metadata;
    uint32_t metadata_count;
    uint32_t srgb_encoded; /* read only: 1 when R, G and B are 8- or 16-bit sRGB codes scaled to [0,1], 0
                              when they are linear */
    const float *chromaticities;       /* {Rx, Ry, Gx, Gy, Bx, By, Wx, Wy}, or null */
    /* The pixels are [left, left + width) × [top, top + height) of a picture of whole_width ×
       whole_height, which is 0 × 0 where they are all of it. EXR: data window and display window. */
    int32_t left, top;
    uint32_t whole_width, whole_height;
    /* EXR, to write only: 4 × 4, row-major, for points as rows, as OpenEXR defines the attributes of these
     * names; or null. */
    const float *world_to_camera, *world_to_ndc;
    const float *adopted_neutral;      /* to write only: {x, y}, or null */
    float white_luminance_cd_m2;       /* to write only: of (1, 1, 1); 0: not known */
    CrtUnappliedTags tags;             /* read only */
} CrtImagePlanes;

#define CRT_TEXELS_UINT8 0u
#define CRT_TEXELS_UINT16 1u
#define CRT_TEXELS_FLOAT 2u

/* The pixels of an image that is a value of a scene: as the file holds them, without alpha. */
typedef struct CrtTexelsInfo {
    uint32_t width, height;
    uint32_t channels;             /* 1: grey; 3: red, green, blue */
    uint32_t type;                 /* CRT_TEXELS_…; floats are linear */
    uint32_t has_chromaticities;
    float chromaticities[8];       /* {Rx, Ry, Gx, Gy, Bx, By, Wx, Wy} */
    uint32_t is_associated;        /* 1: colours are multiplied by the alpha beside them */
    CrtUnappliedTags tags;
} CrtTexelsInfo;

typedef struct CrtImageModule {
    uint32_t struct_size;
    uint32_t reserved;
    /* The library behind it, e.g. "OpenImageIO 2.4.7". */
    const char *build;
    /* Null in other modules; the module that has it reads nothing, and its other functions are null. Every
       float channel as float, every integer channel as uint32, zip compressed. The file name need not end in
       .exr. */
    int32_t (*write_exr)(const char *path, const CrtImagePlanes *image, char *reason, uint32_t reason_size);
    /* Null in the modules of EXR. 8-bit RGB, sRGB-encoded, interleaved. */
    int32_t (*write_png)(const char* path, uint32_t width, uint32_t height, const uint8_t* rgb,
                         const CrtImageText* metadata, uint32_t metadata_count, char* reason,
                         uint32_t reason_size);
    /* The same as a JPEG. */
    int32_t (*write_jpeg)(const char* path, uint32_t width, uint32_t height, const uint8_t* rgb,
                          const CrtImageText* metadata, uint32_t metadata_count, char* reason,
                          uint32_t reason_size);
    /* EXR, or PNG and Radiance HDR, by content; the first image of a file that holds several. One whose
       pixels take more than most_bytes is refused. *image stays valid until freed. */
    int32_t (*read)(const char *path, uint64_t most_bytes, const CrtImagePlanes **image, char *reason,
                    uint32_t reason_size);
    void (*free_image)(const CrtImagePlanes *image);
    /* EXR, or PNG, Radiance HDR, JPEG and TGA, by content. *info is filled in; with a buffer, which must
       have the bytes that an earlier *info says, [height][width][channels], too. */
    int32_t (*read_texels)(const char *path, CrtTexelsInfo *info, void *buffer, uint64_t buffer_bytes,
                           char *reason, uint32_t reason_size);
    /* The same of alpha: one channel, or none (info->channels is 0) where all of the image is there. */
    int32_t (*read_alpha)(const char *path, CrtTexelsInfo *info, void *buffer, uint64_t buffer_bytes,
                          char *reason, uint32_t reason_size);
} CrtImageModule;

typedef const CrtImageModule *(*CrtImageModuleEntry)(void);

#ifdef __cplusplus
}
#endif
#endif
