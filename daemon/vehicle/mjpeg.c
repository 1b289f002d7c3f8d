/* SPDX-License-Identifier: BSD-3-Clause
 * libjpeg-turbo with a memory manager that hands out pieces of one block and
 * begins anew with every frame. */
#include "mjpeg.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* jpeglib.h wants FILE and size_t before it. */
#include <jpeglib.h>

#define ALIGN 64u

typedef struct decoder_error {
    struct jpeg_error_mgr base;
    jmp_buf escape;
    char text[JMSG_LENGTH_MAX];
} decoder_error_t;

struct oc_mjpeg {
    uint32_t width_px, height_px;
    struct jpeg_decompress_struct cinfo;
    bool is_created;
    decoder_error_t error;
    struct jpeg_memory_mgr memory, *libjpegs_own; /* ours while decoding, its own to create and to destroy with */
    struct jpeg_source_mgr source;
    uint8_t *block;
    size_t block_bytes, used;
    uint8_t *rgb;
};

/* ---- memory ---- */

static void *piece(j_common_ptr cinfo, int pool, size_t n_bytes)
{
    (void)pool;
    oc_mjpeg_t *m = cinfo->client_data;
    const size_t whole = (n_bytes + ALIGN - 1u) / ALIGN * ALIGN;
    if (whole < n_bytes || whole > m->block_bytes - m->used) {
        snprintf(m->error.text, sizeof m->error.text, "needs more memory than a frame of a camera does");
        longjmp(m->error.escape, 1);
    }
    void *out = m->block + m->used;
    m->used += whole;
    return out;
}

static JSAMPARRAY sample_array(j_common_ptr cinfo, int pool, JDIMENSION width, JDIMENSION n_rows)
{
    JSAMPARRAY rows = piece(cinfo, pool, n_rows * sizeof *rows);
    for (JDIMENSION i = 0; i < n_rows; i++) rows[i] = piece(cinfo, pool, width);
    return rows;
}

static JBLOCKARRAY block_array(j_common_ptr cinfo, int pool, JDIMENSION width, JDIMENSION n_rows)
{
    JBLOCKARRAY rows = piece(cinfo, pool, n_rows * sizeof *rows);
    for (JDIMENSION i = 0; i < n_rows; i++) rows[i] = piece(cinfo, pool, width * sizeof **rows);
    return rows;
}

/* Whole-picture arrays are for progressive files, which are refused before it comes to that. */
static void refuse_virtual(j_common_ptr cinfo)
{
    oc_mjpeg_t *m = cinfo->client_data;
    snprintf(m->error.text, sizeof m->error.text, "is not baseline JPEG");
    longjmp(m->error.escape, 1);
}

static jvirt_sarray_ptr virtual_samples(j_common_ptr cinfo, int pool, boolean is_zero, JDIMENSION width,
                                        JDIMENSION n_rows, JDIMENSION n_access)
{
    (void)pool, (void)is_zero, (void)width, (void)n_rows, (void)n_access;
    refuse_virtual(cinfo);
    return NULL;
}

static jvirt_barray_ptr virtual_blocks(j_common_ptr cinfo, int pool, boolean is_zero, JDIMENSION width,
                                       JDIMENSION n_rows, JDIMENSION n_access)
{
    (void)pool, (void)is_zero, (void)width, (void)n_rows, (void)n_access;
    refuse_virtual(cinfo);
    return NULL;
}

static void realize_none(j_common_ptr cinfo)
{
    (void)cinfo;
}

static JSAMPARRAY access_samples(j_common_ptr cinfo, jvirt_sarray_ptr array, JDIMENSION first, JDIMENSION n,
                                 boolean is_written)
{
    (void)array, (void)first, (void)n, (void)is_written;
    refuse_virtual(cinfo);
    return NULL;
}

static JBLOCKARRAY access_blocks(j_common_ptr cinfo, jvirt_barray_ptr array, JDIMENSION first, JDIMENSION n,
                                 boolean is_written)
{
    (void)array, (void)first, (void)n, (void)is_written;
    refuse_virtual(cinfo);
    return NULL;
}

static void free_none(j_common_ptr cinfo, int pool)
{
    (void)cinfo, (void)pool;
}

static void destruct_none(j_common_ptr cinfo)
{
    (void)cinfo;
}

/* ---- faults ---- */

static void on_error(j_common_ptr cinfo)
{
    oc_mjpeg_t *m = cinfo->client_data;
    cinfo->err->format_message(cinfo, m->error.text);
    longjmp(m->error.escape, 1);
}

/* Every warning means that the data is damaged. */
static void on_message(j_common_ptr cinfo, int level)
{
    if (level < 0) on_error(cinfo);
}

static void on_output(j_common_ptr cinfo)
{
    (void)cinfo;
}

/* ---- input: the frame, and nothing after it ---- */

static void source_init(j_decompress_ptr cinfo)
{
    (void)cinfo;
}

static boolean source_fill(j_decompress_ptr cinfo)
{
    oc_mjpeg_t *m = cinfo->client_data;
    snprintf(m->error.text, sizeof m->error.text, "is cut");
    longjmp(m->error.escape, 1);
}

static void source_skip(j_decompress_ptr cinfo, long n)
{
    if (n <= 0) return;
    if ((size_t)n > cinfo->src->bytes_in_buffer) (void)source_fill(cinfo);
    cinfo->src->next_input_byte += n;
    cinfo->src->bytes_in_buffer -= (size_t)n;
}

/* ---- the decoder ---- */

/* libjpeg's tables, and per column: coefficients of one row of blocks, rows before and after upsampling. */
static size_t block_size(uint32_t width_px)
{
    return (size_t)(1u << 18) + 256u * (size_t)width_px;
}

static void memory_replace(oc_mjpeg_t *m)
{
    m->memory = (struct jpeg_memory_mgr){.alloc_small = piece,
                                         .alloc_large = piece,
                                         .alloc_sarray = sample_array,
                                         .alloc_barray = block_array,
                                         .request_virt_sarray = virtual_samples,
                                         .request_virt_barray = virtual_blocks,
                                         .realize_virt_arrays = realize_none,
                                         .access_virt_sarray = access_samples,
                                         .access_virt_barray = access_blocks,
                                         .free_pool = free_none,
                                         .self_destruct = destruct_none,
                                         .max_alloc_chunk = (long)m->block_bytes};
    m->libjpegs_own = m->cinfo.mem;
    m->cinfo.mem = &m->memory;
}

/* libjpeg's own objects, once, from the heap. */
static bool decoder_create(oc_mjpeg_t *m)
{
    m->cinfo.err = jpeg_std_error(&m->error.base);
    m->error.base.error_exit = on_error;
    m->error.base.emit_message = on_message;
    m->error.base.output_message = on_output;
    m->cinfo.client_data = m;
    if (setjmp(m->error.escape)) return false;
    jpeg_create_decompress(&m->cinfo);
    m->is_created = true;
    m->source = (struct jpeg_source_mgr){.init_source = source_init,
                                         .fill_input_buffer = source_fill,
                                         .skip_input_data = source_skip,
                                         .resync_to_restart = jpeg_resync_to_restart,
                                         .term_source = source_init};
    m->cinfo.src = &m->source;
    memory_replace(m);
    return true;
}

/* Nothing of the frame before is left: tables that a frame does not bring are the standard ones. */
static void decoder_begin(oc_mjpeg_t *m, const uint8_t *bytes, size_t n_bytes)
{
    struct jpeg_decompress_struct *cinfo = &m->cinfo;
    jpeg_abort_decompress(cinfo);
    m->used = 0;
    for (int i = 0; i < NUM_QUANT_TBLS; i++) cinfo->quant_tbl_ptrs[i] = NULL;
    for (int i = 0; i < NUM_HUFF_TBLS; i++) cinfo->dc_huff_tbl_ptrs[i] = cinfo->ac_huff_tbl_ptrs[i] = NULL;
    m->source.next_input_byte = bytes;
    m->source.bytes_in_buffer = n_bytes;
}

/* Why the head is not that of a frame of ours, NULL when it is. */
static const char *head_fault(const oc_mjpeg_t *m)
{
    const struct jpeg_decompress_struct *cinfo = &m->cinfo;
    if (cinfo->image_width != m->width_px || cinfo->image_height != m->height_px) return "is of another size";
    if (cinfo->progressive_mode || cinfo->arith_code || cinfo->data_precision != 8) return "is not baseline JPEG";
    if (cinfo->num_components != 1 && cinfo->num_components != 3) return "has neither one nor three components";
    return NULL;
}

static bool decode(oc_mjpeg_t *m)
{
    struct jpeg_decompress_struct *cinfo = &m->cinfo;
    if (setjmp(m->error.escape)) return false;
    (void)jpeg_read_header(cinfo, TRUE);
    const char *fault = head_fault(m);
    if (fault) {
        snprintf(m->error.text, sizeof m->error.text, "%s", fault);
        return false;
    }
    cinfo->out_color_space = JCS_RGB;
    (void)jpeg_start_decompress(cinfo);
    while (cinfo->output_scanline < m->height_px) {
        JSAMPROW row = m->rgb + (size_t)cinfo->output_scanline * m->width_px * 3u;
        (void)jpeg_read_scanlines(cinfo, &row, 1);
    }
    (void)jpeg_finish_decompress(cinfo); /* up to the end-of-image marker */
    return true;
}

bool oc_mjpeg_decode(oc_mjpeg_t *m, const uint8_t *bytes, size_t n_bytes, oc_image_t *image, char *error,
                     size_t error_bytes)
{
    decoder_begin(m, bytes, n_bytes);
    if (!decode(m)) {
        snprintf(error, error_bytes, "frame %s", m->error.text);
        return false;
    }
    *image = (oc_image_t){m->rgb, m->width_px, m->height_px, 3u * m->width_px, 3};
    return true;
}

oc_mjpeg_t *oc_mjpeg_create(uint32_t width_px, uint32_t height_px)
{
    oc_mjpeg_t *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    m->width_px = width_px;
    m->height_px = height_px;
    m->block_bytes = (block_size(width_px) + ALIGN - 1u) / ALIGN * ALIGN;
    m->block = aligned_alloc(ALIGN, m->block_bytes);
    m->rgb = malloc((size_t)width_px * height_px * 3u);
    if (m->block && m->rgb && decoder_create(m)) {
        memset(m->block, 0xff, m->block_bytes); /* so that its pages are there from the start */
        memset(m->rgb, 0x80, (size_t)width_px * height_px * 3u);
        return m;
    }
    oc_mjpeg_destroy(m);
    return NULL;
}

void oc_mjpeg_destroy(oc_mjpeg_t *m)
{
    if (!m) return;
    if (m->is_created) {
        m->cinfo.mem = m->libjpegs_own;
        jpeg_destroy_decompress(&m->cinfo);
    }
    free(m->block);
    free(m->rgb);
    free(m);
}
