/*
 * context.h: the first argument of every function that reads the scene.
 */
#ifndef CRT_CONTEXT_H
#define CRT_CONTEXT_H

#include "kernel/dialect/layout.h"

CRT_KERNEL_BEGIN

/* The scene as a kernel sees it: the blob and its header. A backend may carry its own handle along
 * (CRT_CONTEXT_EXTRA). */
#ifndef CRT_CONTEXT_EXTRA
#define CRT_CONTEXT_EXTRA
#endif
/* 1: a processor works on the vertices of several paths in turn, and fetches from memory meanwhile. */
#ifndef CRT_TAKES_TURNS
#define CRT_TAKES_TURNS 0
#endif
typedef struct CrtContext {
    CRT_GLOBAL const CRT_BYTE *blob;
    CRT_GLOBAL const CrtScene *scene;
    CRT_CONTEXT_EXTRA
} CrtContext;

CRT_KERNEL_END

#endif
