/*
 * layout.h: the compiled scene as bytes. One pointer-free blob: a CrtScene header, then arrays that its
 * spans point to. Written by core/compile/compile.cpp, read as it lies by every kernel. Fixed-width members,
 * every struct a multiple of 16 bytes, sizes asserted. A change here changes CRT_LAYOUT_HASH, and plugins
 * built with another hash are refused.
 *
 * Over 450 lines: one layout, which is hashed as it lies here.
 *
 * Units: the scene is moved to its centre and scaled by a power of two at load (lengths here are in these
 * units); radiance in W·m⁻²·sr⁻¹·nm⁻¹; wavelengths in nm.
 */
#ifndef CRT_LAYOUT_H
#define CRT_LAYOUT_H

#include "kernel/dialect/channels.h"
#include "kernel/dialect/dialect.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/integrators.h"

CRT_KERNEL_BEGIN

#define CRT_SCENE_MAGIC 0x53545243u /* "CRTS" */
#define CRT_NONE 0xffffffffu
#define CRT_MOST_EVENTS 0x3ffffffu /* that the state of a path can count (path_state.h) */

#define CRT_WAVELENGTH_MIN_NM 360.0f
#define CRT_WAVELENGTH_COUNT 471u     /* 360, 361, … 830 nm */
#define CRT_SPECTRUM_STRIDE 472u      /* floats from one spectrum to the next; the last repeats 830 nm */
#define CRT_WAVELENGTH_TABLE 1024u    /* cells of the inverse distribution of wavelengths: TABLE + 1 nodes */
/* Cells of the inverse distribution of the pixel filter, TABLE + 1 nodes: STEPS for each halving of the
   share of the filter that is farther from the middle, which there is in OCTAVES halvings. */
#define CRT_FILTER_OCTAVES 24u
#define CRT_FILTER_STEPS 64u
#define CRT_FILTER_TABLE (CRT_FILTER_OCTAVES * CRT_FILTER_STEPS)

/* An array in the blob: `offset` in units of 16 bytes from its start. */
typedef struct CrtSpan {
    u32 offset, count;
} CrtSpan;

/* A tabulated spectrum: a value each nanometre from 360 nm, the last one twice. */
typedef struct CrtSpectrumRow {
    f32 values[CRT_SPECTRUM_STRIDE];
} CrtSpectrumRow;

#define CRT_ARRAY(type, blob, span) ((CRT_GLOBAL const type *)((blob) + (u64)(span).offset * 16u))

/* Geometry of one triangle: x of its three vertices, then y, then z. Or a shape, whose box stands there:
   its lower corner, its upper one, and the lower one again. */
typedef struct CrtTriangle {
    f32 p[9];
    u32 id;        /* primitive id: position in the author's order, decides ties; of shapes the last */
    u32 shape;     /* 0: a triangle; CRT_SLOT_INSTANCE + index of a CrtInstance; 1 + that of a CrtShape */
    u32 reserved;
} CrtTriangle;
CRT_ASSERT_SIZE(CrtTriangle, 48);

#define CRT_SLOT_INSTANCE 0x80000000u

/* An instance of a mesh. The mesh's triangles, in its own coordinates within ±1, come after those of the
   slots, in leaf order; their `id` is the number of their primitive, and of its texture coordinates and
   colours. to_world transforms them into the scene; to_mesh transforms rays for the tests of their boxes,
   which grow by crt_instance_slack for the rounding of that. */
typedef struct CrtInstance {
    f32 to_world[12]; /* rows of x, y, z: x, y, z, 1 */
    f32 to_mesh[12];
    f32 slack_per_length, slack;
    f32 facing;          /* -1: mirrored */
    u32 root;            /* in mesh_nodes */
    u32 first_primitive; /* of the mesh */
    u32 first_id;        /* of the instance's triangles, as primitives of the scene */
    u32 reserved[2];
} CrtInstance;
CRT_ASSERT_SIZE(CrtInstance, 128);

#define CRT_SHAPE_SPHERE 0u   /* around the centre */
#define CRT_SHAPE_DISK 1u     /* in the plane of x and y */
#define CRT_SHAPE_CYLINDER 2u /* around z, without ends */

/* A surface of the second order, in a frame of unit axes that are perpendicular to each other. It ends at
   from_z and to_z, in the frame. A rim that another surface touches has a lip: rays meet the shape that
   much beyond it, so that none slips between the two. A lip does not shine. */
typedef struct CrtShape {
    f32 centre[3];
    f32 radius;
    f32 x[3];
    f32 from_z;
    f32 y[3];
    f32 to_z;
    f32 z[3];
    u32 kind;   /* CRT_SHAPE_… */
    f32 facing; /* 1: normals point outwards, a disk's along z; -1: the other way */
    f32 met_from, met_to; /* ends as rays meet them, with lips; of a disk met_to is the radius */
    f32 reserved;
} CrtShape;
CRT_ASSERT_SIZE(CrtShape, 80);

/* Eight triangles side by side, for the brute-force loops. A row (x, y, z, w) is an affine function of a
   point p: x·p.x + y·p.y + z·p.z + w. Row 0 is the height over the triangle's plane; rows 1 to 3 the
   distance from each edge, positive inside. Unused lanes have slot CRT_NONE and are CRT_UNUSED_HEIGHT below
   every point: farther than the slack of any ray, whose origin may be far outside the scene. */
#define CRT_UNUSED_HEIGHT 1e30f
#define CRT_HEIGHT_SCALE 16.0f /* of heights that are compared with the slack of a ray */
typedef struct CrtTriangle8 {
    f32 row[4][4][8];
    f32 height_slack[8]; /* crt_height_slack (surface.h) */
    u32 slot[8];         /* in the triangle array */
} CrtTriangle8;
CRT_ASSERT_SIZE(CrtTriangle8, 576);

/* Two triangles of one plane with a common edge, or one triangle, inside a parallelogram: two strips of
   their plane. A row (x, y, z, w) is an affine function of a point p: x·p.x + y·p.y + z·p.z + w, in
   lengths. */
typedef struct CrtPatch {
    f32 plane[4];  /* height over it; (x, y, z) is its unit normal */
    f32 first[4];  /* distance from the middle of one strip, within the plane */
    f32 second[4];
    f32 sizes[4];  /* half the width of the first strip, and of the second; crt_height_slack (surface.h) over
                      CRT_HEIGHT_SCALE; 1 where there is one triangle, otherwise 0 */
    f32 third[4];  /* of one triangle: distance from the edge that halves the parallelogram, inside
                      positive */
    u32 slot[2];   /* in the triangle array; the second CRT_NONE where there is one */
    u32 reserved[2];
} CrtPatch;
CRT_ASSERT_SIZE(CrtPatch, 96);

/* The plane of a triangle (of a shape: 0), by slot; how far off it a ray must start to be sure of its side,
   and how far from its edges, in barycentrics (of a shape: lengths), to be sure of its neighbours'
   (surface.h). */
typedef struct CrtFace {
    f32 normal[3]; /* unit, by the order of the vertices */
    f32 clearance;
    f32 margin;
    f32 reserved0, reserved1, reserved2;
} CrtFace;
CRT_ASSERT_SIZE(CrtFace, 32);

/* The material, light, normals and object of a triangle, by primitive id. */
typedef struct CrtPrimitive {
    u32 material;
    u32 light;    /* index of its CrtLight, or CRT_NONE */
    u32 normals;  /* index of its CrtNormals, or CRT_NONE: flat */
    u32 object;   /* and CRT_PRIMITIVE_TOUCHES */
} CrtPrimitive;
/* In `object`: the surface of another body coincides with it (medium.h). */
#define CRT_PRIMITIVE_TOUCHES 0x80000000u
CRT_ASSERT_SIZE(CrtPrimitive, 16);

/* Unit shading normals at the three vertices: x of all, y of all, z of all. */
typedef struct CrtNormals {
    f32 n[9];
    f32 reserved[3];
} CrtNormals;
CRT_ASSERT_SIZE(CrtNormals, 48);

/* Texture coordinates at the three vertices: u of all, v of all. By primitive id, where the scene has
   textures. */
typedef struct CrtUvs {
    f32 uv[6];
    f32 reserved[2];
} CrtUvs;
CRT_ASSERT_SIZE(CrtUvs, 32);

/* Colours of the three vertices: the coefficients of a sigmoid (crt_sigmoid) each. By primitive id, where
   the scene has values that use them. */
typedef struct CrtVertexColors {
    f32 c[9];
    f32 reserved[3];
} CrtVertexColors;
CRT_ASSERT_SIZE(CrtVertexColors, 48);

/* Four children: bounds[2·axis + 0/1][child] is the lower/upper plane. child = index << 4 | count: count >
   0 is a leaf of the slots index … index + count − 1, count = 0 an inner node. An unused child
   has lower = +inf, upper = −inf, so no ray enters it. */
typedef struct CrtNode4 {
    f32 bounds[6][4];
    u32 child[4];
    u32 reserved[4];
} CrtNode4;
CRT_ASSERT_SIZE(CrtNode4, 128);

/* Bounding box of one object's triangles, or of its shape; they lie together in the triangle array when the
 * accelerator is AABB. */
typedef struct CrtObject {
    f32 lower[3];
    u32 first;
    f32 upper[3];
    u32 count;
} CrtObject;
CRT_ASSERT_SIZE(CrtObject, 32);

/* A spectrum or a number that a material or a light has: a reference of 32 bits, read by crt_value (value.h)
   alone. With the sign bit clear it is a constant, the float itself, which costs no load; set, bits 28 to 30
   are the kind and the rest an index. Nothing that a scene says this way is below 0. */
typedef u32 CrtValue;
#define CRT_VALUE_REFERENCE 0x80000000u
#define CRT_VALUE_INDEX 0x0fffffffu
#define CRT_VALUE_KIND 0xf0000000u
#define CRT_VALUE_TABLE 0x80000000u /* kind 0: a spectrum of the scene's table */
#define CRT_VALUE_TEXTURE 0x90000000u /* kind 1: depends on the place: an entry of the scene's textures */

#define CRT_WRAP_REPEAT 0u
#define CRT_WRAP_MIRROR 1u
#define CRT_WRAP_CLAMP 2u

/* A value that depends on the place. Members that a kind does not use are 0. */
typedef struct CrtTexture {
    u32 kind; /* CRT_TEXTURE_… of features.h */
    u32 width, height;
    u32 wrap;    /* CRT_WRAP_…: what lies beyond the image */
    u32 nearest; /* 1: the texel that a place lies in; 0: bilinear between the four around it */
    CrtValue first, second; /* of a pattern; entries before this one where they are textures. Of an image
                               `first` is a factor on its texels: a number, a table or the colours of the
                               vertices; 0: there is none */
    u32 reserved;
    CrtSpan words; /* of 16 bits: the texels of an image, the top row first; of a pattern its numbers, f32 */
    f32 from_uv[6]; /* (s, t) = (f0 u + f1 v + f2, f3 u + f4 v + f5): of images the upper left corner is
                       (0, 0), the lower right (1, 1) */
} CrtTexture;
CRT_ASSERT_SIZE(CrtTexture, 64);

#define CRT_MATERIAL_DISPERSIVE 1u
#define CRT_MATERIAL_TRANSMITS 2u /* light comes out on the other side */
#define CRT_MATERIAL_OPENPBR 4u /* rough conductors and plastic: by the colours that are seen (openpbr.h) */
#define CRT_MATERIAL_UNDER_COAT 8u /* its roughness grows by that of the coat, vertex by vertex */
#define CRT_MATERIAL_TINTED 16u    /* it has a tint (tint.h) */
#define CRT_MATERIAL_TRANSLUCENT 32u /* plastic: a thin sheet with a transmittance (plastic.h) */

/* Steps between the cosines 0 and 1 of a coat's table, which is as long as a spectrum's. */
#define CRT_COAT_STEPS 470.0f
/* The number of tables, one behind the other, of a coat whose roughness depends on the place. The square
   roots of their roughnesses are evenly spaced from 0 to 1. */
#define CRT_COAT_ROUGHNESSES 33u

/* The share of light towards a view that microfacets lose, at steps of the root of its cosine. Behind the
   value of cosine 1, which comes twice, are the mean over the cosine and the share of diffuse light that
   the interface lets in from outside. Then follows, at the same steps, the share of all losses, weighed by
   the cosine, that is nearer to the surface. */
#define CRT_LOSS_STEPS 123.0f
#define CRT_LOSS_MEAN 125.0f
#define CRT_LOSS_PASSED 126.0f
#define CRT_LOSS_SHARES 128u
#define CRT_LOSS_STRIDE 256u
#define CRT_LOSS_AZIMUTHS 17u /* rows of anisotropic microfacets, from along the tangent to across it */

/* Rows of losses, of CRT_LOSS_STRIDE floats: by index, within that by roughness or azimuth, within that of
   the outside and, of dielectrics, the inside. */
typedef struct CrtLoss {
    CrtSpan rows;
    u32 indices, roughnesses, sides;
    f32 first_index, index_scale; /* a row is at (index − first) · scale; of roughnesses, evenly from 0 to
                                     1 */
    u32 by_azimuth; /* 1: in place of the roughnesses, azimuths of anisotropic microfacets (anisotropy.h) */
} CrtLoss;
CRT_ASSERT_SIZE(CrtLoss, 32);

/* Members that a kind does not use are 0. */
typedef struct CrtMaterial {
    u32 type; /* CRT_MATERIAL_… of features.h */
    u32 flags;
    union {
        struct {
            CrtValue reflectance;
        } diffuse; /* and mirrors */
        struct {
            CrtValue eta, k; /* index; of OpenPBR's metals the colour straight on and the tint at the edge */
            CrtValue mean;   /* rough: its reflectance, mean over the cosine, under the film unless that is
                                textured */
            CrtValue factor; /* OpenPBR's metals: on their reflectance */
        } metal;
        struct {
            CrtValue eta; /* index inside over outside */
        } glass; /* dielectrics and panes */
        struct {
            CrtValue reflectance;
            CrtValue eta;
            CrtValue internal; /* share that the coat sends back from below: a number; or, where the
                                  roughness depends on the place, a table by CRT_COAT_ROUGHNESSES */
            CrtValue coat;     /* share that a rough coat reflects, by the cosine: a table, or the first of
                                  CRT_COAT_ROUGHNESSES; 0: smooth */
        } plastic;
    } of; /* by its type */
    CrtValue roughness; /* square root of the width α of GGX */
    u32 medium;    /* of what its surface bounds: 1 + its place in CrtScene.media; 0: it bounds none, or no
                      medium    of the scene matters */
    u32 loss; /* rough conductors and dielectrics: index of their CrtLoss */
    CrtValue film_thickness; /* of film_scale: a texture or 1; 0: there is no film */
    f32 film_scale; /* nm */
    CrtValue film_index; /* relative to the outside */
    f32 widening;  /* anisotropic: the width of GGX along the tangent, over the roughness squared */
    f32 narrowing; /* anisotropic: the width across the tangent over that along it; 0: isotropic */
    f32 turn_cos, turn_sin; /* anisotropic: of the angle from the coordinates' tangent to the material's */
} CrtMaterial;
CRT_ASSERT_SIZE(CrtMaterial, 64);

#define CRT_COMPOSED_PLAIN 0u
#define CRT_COMPOSED_MIX 1u   /* of two materials, one by chance */
#define CRT_COMPOSED_SIDES 2u /* `first` seen from the front, `second` from the back */

#define CRT_OPAQUE 0x3f800000u /* the CrtValue 1 */

/* The composition of a material, by its number. Only scenes with a composed material have these. */
typedef struct CrtComposition {
    u32 kind; /* CRT_COMPOSED_… */
    u32 first, second; /* materials */
    CrtValue amount;   /* mix: the probability of the second */
    CrtValue opacity;  /* the share of the surface that is there */
    CrtValue normal_map; /* a texture of normals; 0: none */
    f32 normal_strength;
    u32 walled; /* beside its facets are walls (normal_map.h) */
} CrtComposition;
CRT_ASSERT_SIZE(CrtComposition, 32);

/* Further properties of a material besides its CrtMaterial, by its number. Only scenes with a material that
   has some hold these. */
typedef struct CrtLayers {
    CrtValue base_loss;  /* plastic with a rough base: what one reflection by it loses, by the cosine, of
                            what it would send back where that is most: a table; 0: Lambert's law */
    f32 base_roughness;
    f32 base_scale;      /* of one reflection: 1 over what it would send back where that is most */
    f32 base_mean;       /* of the table, over the cosine and what the coat lets in */
    f32 fuzz_weight;     /* share of the surface that fuzz lies on */
    f32 fuzz_roughness;
    CrtValue fuzz_color;
    f32 clear_ior;          /* coat: its index; 0: there is none; otherwise: */
    CrtValue clear_roughness;
    CrtValue clear_albedo;  /* what it mirrors by the cosine, as `coat` of plastic; 0: it is smooth */
    CrtValue clear_depth;   /* what is left of light that crosses it straight on is exp(−depth) */
    CrtValue clear_internal; /* share of diffuse light from below that it sends back, as of plastic */
    f32 clear_darkening;    /* how much of what is lost by that is lost */
    CrtValue clear_base;    /* how rough what lies below is, to that end: this times */
    f32 clear_base_share;   /* this, and the rest as rough as can be */
    CrtValue tint;          /* of what is CRT_MATERIAL_TINTED */
    CrtValue transmittance; /* of what is CRT_MATERIAL_TRANSLUCENT: of its base, beside the reflectance */
} CrtLayers;
CRT_ASSERT_SIZE(CrtLayers, 68);

#define CRT_LIGHT_TRIANGLE 0u
#define CRT_LIGHT_PARALLELOGRAM 1u /* two triangles */
#define CRT_LIGHT_ENVIRONMENT 2u   /* from far away: no slot, no area */
/* Lights without a surface: `slot` is the index of a CrtPointLight, there is no area. */
#define CRT_LIGHT_POINT 3u
#define CRT_LIGHT_SPOT 4u
#define CRT_LIGHT_DIRECTIONAL 5u
#define CRT_LIGHT_SUN 6u
#define CRT_LIGHT_IES 7u
#define CRT_LIGHT_DISK_BEAM 8u
#define CRT_LIGHT_SLIT_BEAM 9u
#define CRT_LIGHT_SHAPE 10u /* a sphere, a disk, a cylinder, or a part of one */
#define CRT_LIGHT_TILE 11u  /* a part of a triangle whose radiance is a texture (light.h) */

#define CRT_LIGHT_TWO_SIDED 1u
#define CRT_LIGHT_UNSAMPLED 2u /* left to scattered rays: its surface is not all there */

typedef struct CrtLight {
    u32 kind; /* CRT_LIGHT_… */
    u32 flags;
    CrtValue radiance;
    u32 choice;             /* a 32-bit number u chooses the last light with choice ≤ u; of a light in the
                               tree: 4 times the node + which child */
    f32 choice_probability; /* exactly the share of 2³² that chooses it, or the tree that it is in */
    u32 slot;   /* in the triangle array */
    u32 corner; /* which vertex of the triangle the parallelogram's two edges leave from; of a tile, by
                   CRT_TILE: which one it is */
    f32 area;
} CrtLight;
CRT_ASSERT_SIZE(CrtLight, 32);

/* A triangle with `rows` tiles along each edge has rows² of them, alike and one behind the other among the
   lights: row by row along its second edge, and in each row along its first, those that lie as the triangle
   does and those that lie upside down in turn. */
#define CRT_TILE(rows, row, place) ((rows) << 20u | (row) << 10u | (place))
#define CRT_TILE_ROWS(corner) ((corner) >> 20u)
#define CRT_TILE_ROW(corner) ((corner) >> 10u & 1023u)
#define CRT_TILE_PLACE(corner) ((corner)&1023u)
#define CRT_TILE_ROWS_MAX 256u
/* The tiles of the rows before `row`. */
#define CRT_TILES_BEFORE(rows, row) ((row) * (2u * (rows) - (row)))

/* A node of the tree of lights, the root first. Of each of its four children, what lights are below it:
   where they are, and which way they shine: within acos(cos_o) + acos(cos_e) of the axis. */
typedef struct CrtLightNode {
    f32 centre_x[4], centre_y[4], centre_z[4]; /* of a sphere around them */
    f32 radius[4];
    f32 axis_x[4], axis_y[4], axis_z[4]; /* unit */
    f32 power[4];           /* share of that of all; 0: there is no such child */
    f32 cos_o[4], sin_o[4]; /* spread of their normals around the axis */
    f32 cos_e[4];           /* how far from its normal each shines */
    f32 back[4];            /* -1: some shine on both sides; otherwise 1 */
    u32 child[4];           /* a node; or CRT_LIGHT_LEAF + a row of the light table */
    u32 parent;             /* 4 times the node above + which child of that this is; the root's: 0 */
    u32 reserved[3];
} CrtLightNode;
#define CRT_LIGHT_LEAF 0x80000000u
CRT_ASSERT_SIZE(CrtLightNode, 224);

/* The distribution of an IES light, or the section of a beam. */
typedef struct CrtLightForm {
    f32 u[3];           /* IES: where the horizontal angle 0 is; slit: across; unit, like v perpendicular to
                           the light's direction */
    f32 half_u;         /* slit: half its width; disk: its radius */
    f32 v[3];           /* IES: where the horizontal angle 90 is; slit: along */
    f32 half_v;         /* slit: half its height */
    CrtSpan vertical;   /* IES: f32, angles from the light's direction, radians */
    CrtSpan horizontal; /* IES: f32, 0 to 2π; or 0 alone: the same all round */
    CrtSpan shares;     /* IES: f32, of the greatest intensity: all vertical angles of a horizontal one */
    u32 reserved[2];
} CrtLightForm;
CRT_ASSERT_SIZE(CrtLightForm, 64);

/* The properties of a light without a surface besides its CrtLight, whose `radiance` is a spectrum that
   `strength` multiplies. Suns come first. */
typedef struct CrtPointLight {
    f32 position[3];      /* point, spot, IES; beam: middle of the section that it begins with */
    f32 strength;         /* point, spot (on its axis), IES (where it is greatest): radiant intensity, by
                             squared length here; directional, beam: irradiance of a plane that faces it;
                             sun: radiance */
    f32 direction[3];     /* unit, the way that the light goes; not of a point */
    f32 cone;             /* spot, sun: 1 − cos of the angle from the axis to the edge */
    f32 inverse_penumbra; /* spot: 1 / (cone − (1 − cos) where the penumbra begins) */
    u32 light;            /* index of its CrtLight */
    CrtSpan form;         /* IES, beam: CrtLightForm, 1 */
} CrtPointLight;
CRT_ASSERT_SIZE(CrtPointLight, 48);

/* A texel of the environment: `scale` times the sigmoid (spectrum.h) times the environment's spectrum. */
typedef struct CrtEnvironmentTexel {
    f32 c0, c1, c2;
    f32 scale;
} CrtEnvironmentTexel;
CRT_ASSERT_SIZE(CrtEnvironmentTexel, 16);

/* Latitudes and longitudes. Rows go from `up` down; columns to the right as seen from within, the middle one
   `ahead`. A 32-bit number u chooses the last row with rows ≤ u, and another a column of it. A guide says
   which item each multiple of 2^shift chooses, and ends with the last item: between two such are the items
   that are searched. It has a part for 16 items or more, which a line of a processor's cache holds. */
typedef struct CrtEnvironmentImage {
    u32 width, height;
    CrtSpan texels;        /* CrtEnvironmentTexel, row by row */
    CrtSpan rows;          /* u32, height of them */
    CrtSpan columns;       /* u32, width of them for each row */
    CrtSpan row_guide;     /* u32, 2^(32 - row_shift) + 1 of them */
    CrtSpan column_guides; /* u32, 2^(32 - column_shift) + 1 of them for each row */
    u32 row_shift, column_shift;
    f32 right[3], up[3], ahead[3]; /* unit, perpendicular to each other */
    u32 reserved;
} CrtEnvironmentImage;
CRT_ASSERT_SIZE(CrtEnvironmentImage, 96);

/* The spectral channels of a film, behind all others: the mean radiance in equal bins of wavelengths, then
   the radiance weighted by the responses of sensors. */
typedef struct CrtSpectralFilm {
    u32 channel;       /* of the first bin */
    u32 bins;
    f32 first;         /* lower edge of the first bin, nm above CRT_WAVELENGTH_MIN_NM */
    f32 per_nm;        /* bins in a nanometre */
    CrtSpan responses; /* CrtSpectrumRow */
    u32 reserved[2];
} CrtSpectralFilm;
CRT_ASSERT_SIZE(CrtSpectralFilm, 32);

/* A film point (px, py), in pixels from the top left, looks along corner + px·step_x + py·step_y (not
   normalised; its component along the view axis is 1). */
typedef struct CrtCamera {
    f32 origin[3];
    f32 lens_radius;
    f32 corner[3];
    f32 focus_distance;
    f32 step_x[3];
    f32 reserved0;
    f32 step_y[3];
    f32 reserved1;
    f32 lens_x[3]; /* unit, image right */
    f32 reserved2;
    f32 lens_y[3]; /* unit, image up */
    f32 reserved3;
} CrtCamera;
CRT_ASSERT_SIZE(CrtCamera, 96);

#define CRT_SAMPLER_SOBOL 0u
#define CRT_SAMPLER_INDEPENDENT 1u
#define CRT_SAMPLER_XORSHIFT 2u

/* Next event estimation: none; combined with scattered rays by MIS; or alone wherever light sampling covers
   an emitter from a point, to test it (scattered rays then count what is left to chance). */
#define CRT_NEE_NONE 0u
#define CRT_NEE_MIS 1u
#define CRT_NEE_ONLY 2u

#define CRT_ACCELERATOR_BRUTE_FORCE 0u
#define CRT_ACCELERATOR_BVH 1u
#define CRT_ACCELERATOR_AABB 2u

/* Replicates are scrambled independently of each other, so that the spread of their means is an unbiased
   measure of the image's error. They take turns sample by sample, so that all are equally full whenever a
   render stops. The film holds the sum of Y of each but the last, which is what is left of the sum of all
   (docs/decisions/0007-replicates.md). */
#define CRT_REPLICATES_MAX 16u

/* A seed, and two words that differ for any two seeds, hashed from it once (crt_seed in sampler.h). */
typedef struct CrtSeed {
    u32 low, high;
    u32 first, second;
} CrtSeed;

/* The arrays of a compiled scene: F(type of a row, name, IDENTITY). IDENTITY says how the scene's identity
   hashes an array (core/compile/scene_identity.cpp): ROWS as it is; PLACES by the function with the
   array's name, because its rows hold places in the blob; SEARCH not at all, because it only speeds up the
   search for hits.

     triangles          in leaf order when there is a BVH; behind those of the scene, those of meshes that
                        are instanced
     faces              by slot
     triangles8         only for brute force, as all arrays of eight and of patches
     occluders8         those of them that can come between two points of the scene
     primitives         by id
     nodes              root first; only for BVH
     lights             behind them the CrtLightNode of the tree, if there is one
     uvs                by id; only where a texture or a tangent needs them
     vertex_colors      by id; only where a value needs them
     environment_image  1 or none
     compositions       as many as materials; or none
     layers             as many as materials; or none
     spectral_film      1 or none
     observer           CRT_SPECTRUM_STRIDE times (x̄, ȳ, z̄, 0) / ∫ȳ dλ
     wavelengths        CRT_WAVELENGTH_TABLE + 1 nodes of λ(u), nm
     filter             CRT_FILTER_TABLE + 1 distances from the pixel centre, pixels
     shapes             where slots are in the order of ids, theirs are the last
     mesh_nodes         of the meshes that are instanced
     media              what each medium absorbs, per scene unit
     patches            all triangles
     occluder_patches   the triangles that can come between two points of the scene */
#define CRT_SCENE_ARRAYS(F)                           \
    F(CrtTriangle, triangles, PLACES)                 \
    F(CrtFace, faces, SEARCH)                         \
    F(CrtTriangle8, triangles8, SEARCH)               \
    F(CrtTriangle8, occluders8, SEARCH)               \
    F(CrtPrimitive, primitives, ROWS)                 \
    F(CrtNormals, normals, ROWS)                      \
    F(CrtNode4, nodes, SEARCH)                        \
    F(CrtObject, objects, SEARCH)                     \
    F(CrtMaterial, materials, ROWS)                   \
    F(CrtLight, lights, PLACES)                       \
    F(CrtTexture, textures, PLACES)                   \
    F(CrtUvs, uvs, ROWS)                              \
    F(CrtVertexColors, vertex_colors, ROWS)           \
    F(CrtPointLight, point_lights, PLACES)            \
    F(CrtEnvironmentImage, environment_image, PLACES) \
    F(CrtComposition, compositions, ROWS)             \
    F(CrtLayers, layers, ROWS)                        \
    F(CrtSpectralFilm, spectral_film, PLACES)         \
    F(CrtLoss, losses, PLACES)                        \
    F(CrtSpectrumRow, spectra, ROWS)                  \
    F(f32, observer, ROWS)                            \
    F(f32, wavelengths, ROWS)                         \
    F(f32, filter, ROWS)                              \
    F(CrtShape, shapes, ROWS)                         \
    F(CrtInstance, instances, PLACES)                 \
    F(CrtNode4, mesh_nodes, SEARCH)                   \
    F(CrtValue, media, ROWS)                          \
    F(CrtPatch, patches, SEARCH)                      \
    F(CrtPatch, occluder_patches, SEARCH)

typedef struct CrtScene {
    u32 magic;
    u32 environment_light; /* 1 + the index of its CrtLight; 0: light sampling leaves it to scattered rays */
    u64 features;          /* of the scene; the kernel has at least these */
    u32 integrator; /* CRT_INTEGRATOR_… */
    u32 accelerator;

    u32 width, height;           /* of the crop window: what the film holds */
    u32 crop_x, crop_y;          /* its top left pixel */

    u32 film_width, film_height; /* of the whole film */
    u32 channels;
    u32 aovs;

#define CRT_CHANNEL_MEMBER(bit, NAME, Name, stem, width, SOURCE, name, exr) u32 stem##_channel;
    CRT_CHANNEL_LIST(CRT_CHANNEL_MEMBER) /* first channel of each; 0 when not asked for */

    f32 depth_scale;             /* scene units per length here: a power of two */
    u32 replicate_shift;         /* there are 2^shift replicates; 0: one sequence */
    u32 sampler;

    u32 max_depth;               /* scattering events, up to CRT_MOST_EVENTS */
    u32 roulette_depth;          /* CRT_NONE: never */
    u32 nee;
    CrtValue environment;        /* its radiance, of an image per unit of its texels; or CRT_NONE */

    CrtSeed seed;

    u32 triangle_count; /* slots: triangles, shapes and instances */
    u32 tree_lights; /* the first of the lights, between which the tree chooses; 0: there is none */

#define CRT_SCENE_ARRAY(Row, name, IDENTITY) CrtSpan name;
    CRT_SCENE_ARRAYS(CRT_SCENE_ARRAY)

    CrtCamera camera;

    u32 medium_bits;             /* of a medium's number in a list of them (medium.h): 1, 2, 4, 8 or 16 */
    u32 camera_media;            /* list of the media around the camera */
    f64 splat_scale;             /* units of a splat's sum in 1: a power of two; 0: the film takes none */
    u32 reserved[2];
} CrtScene;
CRT_ASSERT_SIZE(CrtScene, 480);

/* Words of a pixel in the plane of splats; 0: the film takes none. */
CRT_FN u32 crt_splat_words(CRT_GLOBAL const CrtScene *scene) {
    return (scene->aovs & CRT_AOV_SPLATS) != 0u ? CRT_SPLAT_WORDS(1u << scene->replicate_shift) : 0u;
}

CRT_KERNEL_END

#endif
