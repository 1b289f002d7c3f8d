/* SPDX-License-Identifier: BSD-3-Clause
 * Bit-parallel search for junctions, one column of 64 pixels after the other.
 *
 *   B+ of column c  -> planes by gradient direction, grown across the edge   (insert)
 *   planes of c - 1 -> each with its neighbours in direction                 (spread)
 *   column c - 2    -> rays of the pixels near which edges differ            (look)
 *
 * so three columns of planes are all that is held, whatever the image. */
#include "vehicle/judoca_search.h"

#include <math.h>
#include <string.h>

/* Samples nearer to the apex than this are not asked for: there the ridges of
 * the branches have run into each other, and an X has no gradient at all. */
#define FIRST_SAMPLE_PX 2

/* Side of the squares whose orientations are compared first. */
#define TILE_PX 8u

/* Rows searched and clustered at a time. */
#define BAND_PX 64u

/* A cluster reaches this far from its first pixel: to each side, and down. */
#define CLUSTER_SIDE_PX 2
#define CLUSTER_DOWN_PX 3u

/* One place per this many pixels at most. */
#define PX_PER_PLACE 16u

/* A place whose rays have gaps counts this share of one without. */
#define WEAK_SHARE 0.7f

/* Contrast at which the prescore reaches one half, grey levels per px. */
#define HALF_CONTRAST 10.0f

/* Places of 64 x 64 pixels are compared in this many steps of the prescore; the one behind CROWD_HALF better ones
 * counts half. */
#define CROWD_BINS 64u
#define CROWD_HALF 16u

static uint32_t tile_pitch(uint32_t n_columns)
{
    return 8u * n_columns + 16u;
}

typedef struct search_pieces {
    size_t plane, tile, block, place; /* bytes */
} search_pieces_t;

static uint32_t search_max_places(uint32_t width_px, uint32_t height_px)
{
    return width_px * height_px / PX_PER_PLACE + BAND_PX;
}

static search_pieces_t search_measure(uint32_t width_px, uint32_t height_px)
{
    const size_t n_tile_rows = (height_px + TILE_PX - 1u) / TILE_PX;
    return (search_pieces_t){
        .plane = 3u * OC_RAYS * (size_t)oc_bitmap_pitch(height_px) * sizeof(uint64_t),
        .tile = (n_tile_rows + 2u) * tile_pitch(oc_bitmap_columns(width_px)) * sizeof(uint16_t),
        .block = BAND_PX / 4u * sizeof(oc_ray_block_t),
        .place = search_max_places(width_px, height_px) * sizeof(oc_place_t),
    };
}

size_t oc_search_size_bytes(uint32_t width_px, uint32_t height_px)
{
    const search_pieces_t p = search_measure(width_px, height_px);
    return 2u * oc_arena_cost(p.plane) + oc_arena_cost(p.tile) + oc_arena_cost(p.block) + oc_arena_cost(p.place);
}

static void table_build(oc_ray_table_t *table, int32_t radius_px, float s_j)
{
    int32_t radius = radius_px < OC_SEARCH_MIN_RADIUS_PX ? OC_SEARCH_MIN_RADIUS_PX : radius_px;
    if (radius > OC_SEARCH_MAX_RADIUS_PX) radius = OC_SEARCH_MAX_RADIUS_PX;
    table->n_samples = (uint32_t)(radius - FIRST_SAMPLE_PX + 1);
    const uint32_t n_needed = (uint32_t)ceilf(s_j * (float)table->n_samples - 1e-4f);
    const uint32_t n_spare = table->n_samples - n_needed;
    table->n_spare = n_spare < 3u ? n_spare : 3u;
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        const double angle = d * 6.283185307179586 / OC_RAYS;
        for (uint32_t s = 0; s < table->n_samples; s++) {
            const double t = radius - (int32_t)s;
            table->dx[d][s] = (int8_t)lrint(t * cos(angle));
            table->dy[d][s] = (int8_t)lrint(t * sin(angle));
        }
    }
}

oc_status_t oc_search_init(oc_search_t *search, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                           int32_t radius_px, float s_j)
{
    OC_ASSERT(search && arena);

    const search_pieces_t p = search_measure(width_px, height_px);
    const size_t bytes[5] = {p.plane, p.plane, p.tile, p.block, p.place};
    void *piece[5];
    for (uint32_t i = 0; i < 5; i++) {
        const oc_status_t status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }
    memset(search, 0, sizeof *search);
    search->pitch = oc_bitmap_pitch(height_px);
    search->n_columns = oc_bitmap_columns(width_px);
    search->n_tile_rows = (height_px + TILE_PX - 1u) / TILE_PX;
    search->edge = piece[0];
    search->near = piece[1];
    search->tile = piece[2];
    search->block = piece[3];
    search->place = piece[4];
    search->max_places = search_max_places(width_px, height_px);
    table_build(&search->table, radius_px, s_j);
    return OC_OK;
}

/* Sector of an eighth turn, 0..4: borders at 5.625, 16.875, 28.125 and 39.375 degrees in 1/1024. */
static uint32_t direction_in_octant(int32_t high, int32_t low)
{
    const int32_t scaled = 1024 * low;
    return (uint32_t)(scaled >= 101 * high) + (uint32_t)(scaled >= 311 * high) + (uint32_t)(scaled >= 547 * high) +
           (uint32_t)(scaled >= 840 * high);
}

/* Signs and octants of an image are as good as random, so nothing here branches. */
static inline uint32_t direction_of(int32_t dx, int32_t dy)
{
    const uint32_t left = dx < 0, up = dy < 0;
    const int32_t ax = dx < 0 ? -dx : dx, ay = dy < 0 ? -dy : dy;
    const uint32_t steep = ax < ay;
    const uint32_t k = direction_in_octant(ax < ay ? ay : ax, ax < ay ? ax : ay);
    uint32_t s = OC_RAYS / 4u * steep + (1u - 2u * steep) * k;
    s = OC_RAYS / 2u * left + (1u - 2u * left) * s;
    s = (1u - 2u * up) * s;
    return (dx | dy) == 0 ? 0 : s % OC_RAYS;
}

uint32_t oc_search_direction(int32_t dx, int32_t dy)
{
    return direction_of(dx, dy);
}

/* ---- insert ---- */

/* Slot of a column in the rings; column -1 is legal. */
static uint32_t ring_slot(int32_t column)
{
    return (uint32_t)(column + 3) % 3u;
}

static uint64_t *ring_plane(const oc_search_t *search, uint64_t *ring, int32_t column, uint32_t direction)
{
    return ring + ((size_t)ring_slot(column) * OC_RAYS + direction) * search->pitch;
}

static void ring_clear(const oc_search_t *search, uint64_t *ring, uint32_t used[3], int32_t column)
{
    const uint32_t slot = ring_slot(column);
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        if (used[slot] >> d & 1u) {
            memset(ring_plane(search, ring, column, d), 0, search->pitch * sizeof(uint64_t));
        }
    }
    used[slot] = 0;
}

static void search_insert(oc_search_t *search, const oc_gradient_t *gradient, int32_t column)
{
    ring_clear(search, search->edge, search->edge_used, column + 1);
    const uint64_t *thin = gradient->thin + oc_bitmap_at(gradient->pitch, (uint32_t)column, 0);
    uint64_t *left = ring_plane(search, search->edge, column - 1, 0);
    uint64_t *mid = ring_plane(search, search->edge, column, 0);
    uint64_t *right = ring_plane(search, search->edge, column + 1, 0);
    uint16_t *tiles = search->tile + tile_pitch(search->n_columns) + 8u * ((uint32_t)column + 1u);
    const uint32_t pitch = search->pitch, tiles_pitch = tile_pitch(search->n_columns), height = gradient->height_px;
    uint32_t used = 0, left_used = 0, right_used = 0;
    for (uint32_t y = 0; y < height; y++) {
        const int16_t *row = gradient->dxdy + 2u * ((size_t)y * gradient->width_px + 64u * (uint32_t)column);
        for (uint64_t rest = thin[y]; rest; rest &= rest - 1u) {
            const uint32_t bit = (uint32_t)__builtin_ctzll(rest);
            const int32_t dx = row[2u * bit], dy = row[2u * bit + 1u];
            const uint32_t d = direction_of(dx, dy);
            /* The pixel and its neighbours across the edge. */
            const size_t at = (size_t)d * pitch + OC_BITMAP_BORDER + y;
            const uint64_t here = (uint64_t)1 << bit;
            const uint64_t upright = (dx < 0 ? -dx : dx) > (dy < 0 ? -dy : dy) ? UINT64_MAX : 0;
            mid[at - 1] |= here & ~upright;
            mid[at] |= here | ((here << 1 | here >> 1) & upright);
            mid[at + 1] |= here & ~upright;
            used |= 1u << d;
            tiles[y / TILE_PX * tiles_pitch + bit / TILE_PX] |= (uint16_t)(1u << d % 16u);
            if (bit == 0 && upright) {
                left[at] |= (uint64_t)1 << 63;
                left_used |= 1u << d;
            } else if (bit == 63 && upright) {
                right[at] |= 1;
                right_used |= 1u << d;
            }
        }
    }
    search->edge_used[ring_slot(column - 1)] |= left_used;
    search->edge_used[ring_slot(column)] |= used;
    search->edge_used[ring_slot(column + 1)] |= right_used;
}

/* ---- spread ---- */

/* Directions, bit d, and the two to each side of each. */
static uint32_t with_neighbours(uint32_t directions)
{
    const uint64_t twice = (uint64_t)directions << 32 | directions;
    return (uint32_t)((twice | twice >> 1 | twice >> 2) | (twice << 1 | twice << 2) >> 32);
}

static void search_spread(oc_search_t *search, const oc_gradient_t *gradient, int32_t column)
{
    const uint64_t *from[OC_RAYS];
    uint64_t *to[OC_RAYS];
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        from[d] = ring_plane(search, search->edge, column, d);
        to[d] = ring_plane(search, search->near, column, d);
    }
    const uint32_t used = search->edge_used[ring_slot(column)];
    uint32_t *near_used = &search->near_used[ring_slot(column)];
    if (used == 0) {
        ring_clear(search, search->near, search->near_used, column);
        return;
    }
    gradient->kernels->spread(from, to, search->pitch);
    *near_used = with_neighbours(used);
}

/* ---- look ---- */

/* Orientations that are not all within two neighbouring 16ths of a half turn. */
static bool orientations_differ(uint32_t met)
{
    const uint32_t n = (uint32_t)__builtin_popcount(met);
    if (n != 2) return n > 2;
    return !((met & met << 1) || met == 0x8001u);
}

/* Pixels of a word whose tile, or one beside it, has edges that differ. met: out, the orientations of all these. */
static uint64_t tiles_active(const oc_search_t *search, uint32_t tile_row, uint32_t column, uint32_t *met)
{
    const uint32_t pitch = tile_pitch(search->n_columns);
    const uint16_t *at = search->tile + (tile_row + 1u) * pitch + 8u * (column + 1u);
    uint32_t sum[10];
    uint32_t any = 0;
    for (int32_t i = -1; i <= 8; i++) {
        sum[i + 1] = (uint32_t)at[i - (int32_t)pitch] | at[i] | at[i + (int32_t)pitch];
        any |= sum[i + 1];
    }
    *met = any;
    if (!orientations_differ(any)) return 0;
    uint64_t active = 0;
    for (uint32_t i = 0; i < 8; i++) {
        if (at[i] && orientations_differ(sum[i] | sum[i + 1] | sum[i + 2])) active |= (uint64_t)0xff << (8u * i);
    }
    return active;
}

/* Where one column is looked at. */
typedef struct look {
    const oc_gradient_t *gradient;
    uint32_t column, first_y;                                      /* of the band */
    const uint64_t *left[OC_RAYS], *mid[OC_RAYS], *right[OC_RAYS]; /* row 0 of the planes */
    uint32_t live;
    uint64_t weak[BAND_PX], strong[BAND_PX];
} look_t;

/* Directions set at one pixel of the band. */
static uint32_t look_rays(const oc_search_t *search, uint32_t row, uint32_t bit, uint32_t first_ray)
{
    const oc_ray_block_t *block = &search->block[row / 4u];
    uint32_t set = 0;
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        set |= (uint32_t)(block->ray[first_ray + d][row % 4u] >> bit & 1u) << d;
    }
    return set;
}

static void look_emit(oc_search_t *search, const look_t *look, uint32_t row, uint32_t bit, bool is_strong)
{
    if (search->n_places++ >= search->max_places) return;

    const uint32_t x = 64u * look->column + bit, y = look->first_y + row;
    const int16_t *g = look->gradient->dxdy + 2u * ((size_t)y * look->gradient->width_px + x);
    const float gx = g[0], gy = g[1];
    const float contrast = sqrtf(gx * gx + gy * gy) / (float)OC_GRADIENT_ONE;
    const float score = contrast / (contrast + HALF_CONTRAST) * (is_strong ? 1.0f : WEAK_SHARE);
    search->place[search->n_places - 1u] = (oc_place_t){
        .x = (uint16_t)x,
        .y = (uint16_t)y,
        .prescore = (uint16_t)(score * 65535.0f),
        .left = look_rays(search, row, bit, 0),
        .right = look_rays(search, row, bit, OC_RAYS),
    };
}

/* Columns of a word within the cluster's reach of a bit. */
static uint64_t cluster_columns(uint32_t bit)
{
    const uint64_t side = ((uint64_t)1 << (2 * CLUSTER_SIDE_PX + 1)) - 1u;
    return bit >= CLUSTER_SIDE_PX ? side << (bit - CLUSTER_SIDE_PX) : side >> (CLUSTER_SIDE_PX - bit);
}

/* The pixel of the cluster nearest to its middle. */
static void cluster_middle(const uint64_t map[BAND_PX], uint32_t row, uint32_t end, uint64_t columns,
                           uint32_t *best_row, uint32_t *best_bit)
{
    int32_t n = 0, sum_x = 0, sum_y = 0;
    for (uint32_t y = row; y < end; y++) {
        for (uint64_t rest = map[y] & columns; rest; rest &= rest - 1u) {
            n++;
            sum_x += __builtin_ctzll(rest);
            sum_y += (int32_t)y;
        }
    }
    int64_t least = INT64_MAX;
    for (uint32_t y = row; y < end; y++) {
        for (uint64_t rest = map[y] & columns; rest; rest &= rest - 1u) {
            const int64_t ex = n * __builtin_ctzll(rest) - sum_x, ey = n * (int32_t)y - sum_y;
            if (ex * ex + ey * ey >= least) continue;
            least = ex * ex + ey * ey;
            *best_row = y;
            *best_bit = (uint32_t)__builtin_ctzll(rest);
        }
    }
}

/* Cut the band's pixels into clusters, one place each. */
static void look_cluster(oc_search_t *search, look_t *look)
{
    for (uint32_t row = 0; row < BAND_PX; row++) {
        while (look->weak[row]) {
            const uint32_t bit = (uint32_t)__builtin_ctzll(look->weak[row]);
            const uint64_t columns = cluster_columns(bit);
            const uint32_t end = row + CLUSTER_DOWN_PX < BAND_PX ? row + CLUSTER_DOWN_PX + 1u : BAND_PX;
            uint64_t strong = 0;
            for (uint32_t y = row; y < end; y++) strong |= look->strong[y] & columns;
            uint32_t best_row = row, best_bit = bit;
            cluster_middle(strong ? look->strong : look->weak, row, end, columns, &best_row, &best_bit);
            look_emit(search, look, best_row, best_bit, strong != 0);
            for (uint32_t y = row; y < end; y++) {
                look->weak[y] &= ~columns;
                look->strong[y] &= ~columns;
            }
        }
    }
}

/* Lower the prescore of what stands behind many in its band, so that a limit
 * on the fits is shared over the image. */
static void look_spread(oc_search_t *search, uint32_t first)
{
    const uint32_t end = search->n_places < search->max_places ? search->n_places : search->max_places;
    uint32_t before[CROWD_BINS + 1] = {0};
    for (uint32_t i = first; i < end; i++) before[search->place[i].prescore / (65536u / CROWD_BINS)]++;
    for (uint32_t bin = CROWD_BINS, sum = 0; bin-- > 0;) {
        const uint32_t n = before[bin];
        before[bin] = sum;
        sum += n;
    }
    for (uint32_t i = first; i < end; i++) {
        oc_place_t *place = &search->place[i];
        const uint32_t rank = before[place->prescore / (65536u / CROWD_BINS)];
        place->prescore = (uint16_t)(place->prescore * CROWD_HALF / (CROWD_HALF + rank));
    }
}

/* Search one band of a column; false when there was nothing to look at. */
static bool look_band(oc_search_t *search, look_t *look)
{
    const oc_gradient_t *gradient = look->gradient;
    const uint64_t *thin = gradient->thin + oc_bitmap_at(gradient->pitch, look->column, look->first_y);
    uint64_t any = 0;
    for (uint32_t row = 0; row < BAND_PX; row += 4) {
        const uint32_t y = look->first_y + row;
        oc_ray_block_t *block = &search->block[row / 4u];
        memset(&look->weak[row], 0, 4 * sizeof look->weak[0]);
        memset(&look->strong[row], 0, 4 * sizeof look->strong[0]);
        if (y >= gradient->height_px) continue;

        uint32_t met;
        const uint64_t active = tiles_active(search, y / TILE_PX, look->column, &met);
        uint64_t wanted[4], some = 0;
        for (uint32_t i = 0; i < 4; i++) some |= wanted[i] = thin[row + i] & active;
        if (some == 0) continue;

        const uint64_t *left[OC_RAYS], *mid[OC_RAYS], *right[OC_RAYS];
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            left[d] = look->left[d] + y;
            mid[d] = look->mid[d] + y;
            right[d] = look->right[d] + y;
        }
        /* Rays that end, with the pixel that planes are grown by, within the tiles beside see no other orientations. */
        const bool is_within = search->table.dx[0][0] < (int32_t)TILE_PX;
        const uint32_t live = look->live & (is_within ? with_neighbours(met << 16 | met) : UINT32_MAX);
        gradient->kernels->rays(&search->table, left, mid, right, live, wanted, block);
        for (uint32_t i = 0; i < 4; i++) {
            look->weak[row + i] = block->weak[i];
            look->strong[row + i] = block->strong[i];
            any |= block->weak[i];
        }
    }
    return any != 0;
}

static void search_look(oc_search_t *search, const oc_gradient_t *gradient, uint32_t column)
{
    const int32_t c = (int32_t)column;
    look_t look = {.gradient = gradient, .column = column};
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        look.left[d] = ring_plane(search, search->near, c - 1, d) + OC_BITMAP_BORDER;
        look.mid[d] = ring_plane(search, search->near, c, d) + OC_BITMAP_BORDER;
        look.right[d] = ring_plane(search, search->near, c + 1, d) + OC_BITMAP_BORDER;
    }
    for (uint32_t slot = 0; slot < 3; slot++) look.live |= search->near_used[slot];
    for (uint32_t y = 0; y < gradient->height_px; y += BAND_PX) {
        look.first_y = y;
        const uint32_t first = search->n_places;
        if (!look_band(search, &look)) continue;
        look_cluster(search, &look);
        look_spread(search, first);
    }
}

void oc_search_run(oc_search_t *search, const oc_gradient_t *gradient)
{
    OC_ASSERT(search && search->edge && gradient && gradient->thin);

    const int32_t n = (int32_t)search->n_columns;
    search->n_places = 0;
    memset(search->tile, 0, (search->n_tile_rows + 2u) * tile_pitch(search->n_columns) * sizeof search->tile[0]);
    for (int32_t c = -1; c <= 1; c++) {
        ring_clear(search, search->edge, search->edge_used, c);
        ring_clear(search, search->near, search->near_used, c);
    }
    for (int32_t c = 0; c < n + 2; c++) {
        if (c < n) {
            search_insert(search, gradient, c);
        } else {
            ring_clear(search, search->edge, search->edge_used, c + 1);
        }
        if (c >= 1) search_spread(search, gradient, c - 1);
        if (c >= 2) search_look(search, gradient, (uint32_t)(c - 2));
    }
}
