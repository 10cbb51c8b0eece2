/*
 * integrators.h: the integrators, one row each. The words of scene files, the numbers in CrtScene, the
 * features of kernels and the schedules' dispatch are made from these rows.
 *
 * CRT_INTEGRATOR_LIST(I) calls I(number, NAME, Name, "word", stem, KERNELS, light, surfaces, splats):
 *
 *   stem      a sample starts with a camera ray (crt_path_begin); crt_<stem>_advance takes it one vertex
 *             further until it returns 0, and crt_<stem>_end returns its XYZ (integrators/integrator.h)
 *   KERNELS   the feature of the kernels that have it; ALL: every kernel has it, and its row is the last
 *   light     1: it measures light; 0: its image is of colours
 *   surfaces  1: it traces rays to surfaces; 0: it needs the objects' boxes alone
 *   splats    1: it may add to any pixel (film/splat.h): its films have a plane for that
 */
#ifndef CRT_INTEGRATORS_H
#define CRT_INTEGRATORS_H

#define CRT_INTEGRATOR_LIST(I)                                  \
    I(1, NORMALS, Normals, "normals", normals, VIEW, 0, 1, 0)   \
    I(2, AABB, Aabb, "aabb", aabb, VIEW, 0, 0, 0)               \
    I(3, SPLAT_TEST, SplatTest, "splat_test", splat_test, SPLAT, 1, 1, 1) \
    I(0, PATH, Path, "path", path, ALL, 1, 1, 0)

#define CRT_INTEGRATOR_ENUM(number, NAME, Name, word, stem, KERNELS, light, surfaces, splats) \
    CRT_INTEGRATOR_##NAME = number,
enum CrtIntegratorNumber { CRT_INTEGRATOR_LIST(CRT_INTEGRATOR_ENUM) };

#endif
