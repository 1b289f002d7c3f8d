/* SPDX-License-Identifier: BSD-3-Clause
 * A junction: a sub-pixel apex and the directions of the edges that meet there. */
#ifndef OUTCROP_CORE_JUNCTION_H
#define OUTCROP_CORE_JUNCTION_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Branches one junction may carry; 12 bytes each in oc_junction_t. */
#define OC_MAX_BRANCHES 6u

/* Junctions one view may carry; sizes every per-view table. */
#ifndef OC_MAX_JUNCTIONS
#define OC_MAX_JUNCTIONS 1024u
#endif

/* Where a junction stands. Decided by the ground filter on board, advice to
 * the base. */
typedef enum oc_label {
    OC_LABEL_UNKNOWN = 0,  /* no stored view decides it */
    OC_LABEL_OBSTACLE = 1, /* seen to be off the ground plane */
    OC_LABEL_GROUND = 2    /* on Z = 0 */
} oc_label_t;

/* What meets at the apex. */
typedef enum oc_junction_kind {
    OC_KIND_OTHER = 0, /* five or more branches */
    OC_KIND_L = 1,     /* two branches */
    OC_KIND_T = 2,     /* three, two of them collinear */
    OC_KIND_Y = 3,     /* three, none collinear */
    OC_KIND_X = 4,     /* four */
    OC_KIND_CORNER = 5 /* one that is no edge but the orientation of a corner */
} oc_junction_kind_t;

typedef struct oc_branch {
    float angle_rad; /* of the ray from the apex, atan2(dy, dx), y down, in [0, 2 pi) */
    float length_px; /* how far the edge was followed */
    float strength;  /* share of B+ pixels on the ray (thesis 3.3), 0..1 */
} oc_branch_t;

/* Branches are sorted by angle. */
typedef struct oc_junction {
    float x_px, y_px; /* apex; integers are pixel centres */
    float score;      /* larger is better; comparable within one image */
    uint8_t n_branches;
    uint8_t kind;       /* oc_junction_kind_t */
    uint8_t label;      /* oc_label_t */
    uint8_t confidence; /* of the label, 0..255 */
    oc_branch_t branch[OC_MAX_BRANCHES];
} oc_junction_t;

/* The kind that the number and directions of branches say, angles in [0, 2 pi):
 * three of which two are collinear within 12 degrees are a T. One is a corner,
 * none is OC_KIND_OTHER. */
oc_junction_kind_t oc_junction_kind_of(const oc_branch_t branch[], unsigned n_branches);

/* Two branches, angles in [0, 2 pi), that are one straight edge through the
 * apex: they point away from each other within the same 12 degrees. Such a
 * pair says nothing of a plane's turn about it. */
bool oc_junction_is_straight(const oc_branch_t *a, const oc_branch_t *b);

/* Branches that have a straight partner: bit i of branch[i]. The bar of a T
 * has two bits, an X of two crossing edges four. n_branches at most
 * OC_MAX_BRANCHES. */
uint8_t oc_junction_straight_branches(const oc_branch_t branch[], unsigned n_branches);

#ifdef __cplusplus
}
#endif
#endif
