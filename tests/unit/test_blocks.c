/* SPDX-License-Identifier: BSD-3-Clause
 * Tests of core/blocks.h against a floating-point cosine transform, flat blocks, and hostile bits. */
#include <math.h>
#include <string.h>

#include "core/blocks.h"
#include "unity.h"

#define SEED 0xb10c5u

void setUp(void) {}
void tearDown(void) {}

static uint32_t next_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/* An edge of random direction, place and contrast with a little noise. */
static void random_block(uint32_t *state, uint8_t px[64])
{
    const double angle = (double)(next_random(state) % 628u) / 100.0;
    const double place = (double)(next_random(state) % 80u) / 10.0 - 4.0;
    const double low = (double)(next_random(state) % 200u), step = (double)(next_random(state) % 90u) - 45.0;
    for (int i = 0; i < 64; i++) {
        const double along = (i % 8 - 3.5) * cos(angle) + (i / 8 - 3.5) * sin(angle) - place;
        const double soft = 1.0 / (1.0 + exp(-2.0 * along));
        const double value = low + step * soft + (double)(next_random(state) % 5u);
        px[i] = (uint8_t)fmin(255.0, fmax(0.0, value));
    }
}

/* One block alone; returns the bits it took. */
static size_t code_block(unsigned quality, const uint8_t px[64], uint8_t decoded[64])
{
    uint8_t buf[1024];
    oc_block_coder_t coder;
    oc_bit_writer_t writer;
    oc_bit_reader_t reader;
    int32_t level, level_back;
    oc_block_coder_init(&coder, quality);
    oc_bit_writer_init(&writer, buf, sizeof buf);
    oc_block_encode(&coder, &writer, px, 0, &level);
    TEST_ASSERT_FALSE(writer.has_failed);

    oc_block_coder_init(&coder, quality);
    oc_bit_reader_init(&reader, buf, sizeof buf);
    oc_block_decode(&coder, &reader, decoded, 0, &level_back);
    TEST_ASSERT_FALSE(reader.has_failed);
    TEST_ASSERT_EQUAL_size_t(writer.n_bits, reader.n_bits);
    TEST_ASSERT_EQUAL_INT32(level, level_back);
    return writer.n_bits;
}

static double squared_error(const uint8_t a[64], const uint8_t b[64])
{
    double sum = 0.0;
    for (int i = 0; i < 64; i++) {
        const double d = (double)a[i] - (double)b[i];
        sum += d * d;
    }
    return sum;
}

static void flat_blocks_come_back_within_half_a_step(void)
{
    for (unsigned quality = OC_MIN_BLOCK_QUALITY; quality <= OC_MAX_BLOCK_QUALITY; quality++) {
        /* The step of the mean is that of the DC coefficient / 8. */
        const double half_step = 2.0 * pow(2.0, (31.0 - (double)quality) / 5.0) / 8.0 / 2.0;
        for (int grey = 0; grey < 256; grey++) {
            uint8_t px[64], decoded[64];
            memset(px, grey, sizeof px);
            code_block(quality, px, decoded);
            for (int i = 0; i < 64; i++) {
                TEST_ASSERT_DOUBLE_WITHIN(half_step * 1.03 + 0.51, grey, decoded[i]);
            }
        }
    }
}

/* The oracle: quantise the coefficients of a double transform by the same steps and rule. */
static void reference_code(const oc_block_coder_t *coder, const uint8_t px[64], double out[64])
{
    double basis[8][8], coef[64];
    for (int u = 0; u < 8; u++) {
        for (int x = 0; x < 8; x++) {
            basis[u][x] = (u == 0 ? sqrt(0.125) : 0.5) * cos((2 * x + 1) * u * 3.14159265358979323846 / 16.0);
        }
    }
    for (int f = 0; f < 64; f++) {
        double sum = 0.0;
        for (int i = 0; i < 64; i++) {
            sum += basis[f % 8][i % 8] * basis[f / 8][i / 8] * ((double)px[i] - 128.0);
        }
        const double step = (double)coder->step[f] / 16.0;
        coef[f] = copysign(floor(fabs(sum) / step + (f == 0 ? 0.5 : 1.0 / 3.0)) * step, sum);
    }
    for (int i = 0; i < 64; i++) {
        out[i] = 128.0;
        for (int f = 0; f < 64; f++) {
            out[i] += basis[f % 8][i % 8] * basis[f / 8][i / 8] * coef[f];
        }
    }
}

static void blocks_agree_with_a_floating_point_transform(void)
{
    uint32_t state = SEED;
    for (unsigned quality = OC_MIN_BLOCK_QUALITY; quality <= OC_MAX_BLOCK_QUALITY; quality += 3) {
        oc_block_coder_t coder;
        oc_block_coder_init(&coder, quality);
        int n_far = 0;
        for (int trial = 0; trial < 200; trial++) {
            uint8_t px[64], decoded[64];
            double reference[64];
            random_block(&state, px);
            code_block(quality, px, decoded);
            reference_code(&coder, px, reference);
            for (int i = 0; i < 64; i++) {
                const double expected = fmin(255.0, fmax(0.0, reference[i]));
                if (fabs(expected - (double)decoded[i]) > 1.2) n_far++;
            }
        }
        /* A coefficient that lies on a decision limit may fall on either side: at most a block in 20. */
        TEST_ASSERT_TRUE_MESSAGE(n_far <= 200 / 20 * 64, "seed 0xb10c5");
    }
}

static void finer_quality_costs_more_and_errs_less(void)
{
    double last_error = 1e30;
    size_t last_bits = 0;
    for (unsigned quality = 1; quality <= 31; quality += 5) {
        uint32_t state = SEED;
        double error = 0.0;
        size_t bits = 0;
        for (int trial = 0; trial < 100; trial++) {
            uint8_t px[64], decoded[64];
            random_block(&state, px);
            bits += code_block(quality, px, decoded);
            error += squared_error(px, decoded);
        }
        TEST_ASSERT_TRUE(error < last_error && bits > last_bits);
        last_error = error;
        last_bits = bits;
    }
    /* The finest step is 2 grey levels at most 30/16 times: an error of about 1 grey level. */
    TEST_ASSERT_TRUE(last_error / 6400.0 < 1.5);
}

static void extreme_blocks_do_not_overflow(void)
{
    for (unsigned quality = 1; quality <= 31; quality += 10) {
        for (int f = 0; f < 64; f++) {
            uint8_t px[64], decoded[64];
            for (int i = 0; i < 64; i++) {
                const double wave = cos((2 * (i % 8) + 1) * (f % 8) * 3.14159265358979 / 16.0) *
                                    cos((2 * (i / 8) + 1) * (f / 8) * 3.14159265358979 / 16.0);
                px[i] = wave >= 0.0 ? 255 : 0;
            }
            code_block(quality, px, decoded);
            TEST_ASSERT_TRUE(squared_error(px, decoded) / 64.0 < 90.0 * 90.0);
        }
    }
}

static void a_run_of_blocks_decodes_with_the_same_adaptation(void)
{
    enum { N = 300 };
    static uint8_t px[N][64], decoded[N][64], buf[N * 64];
    int32_t levels[N];
    uint32_t state = SEED;
    oc_block_coder_t coder;
    oc_bit_writer_t writer;
    oc_block_coder_init(&coder, 16);
    oc_bit_writer_init(&writer, buf, sizeof buf);
    for (int i = 0; i < N; i++) {
        random_block(&state, px[i]);
        oc_block_encode(&coder, &writer, px[i], i > 0 ? levels[i - 1] : 0, &levels[i]);
    }
    oc_bit_reader_t reader;
    oc_block_coder_init(&coder, 16);
    oc_bit_reader_init(&reader, buf, sizeof buf);
    for (int i = 0; i < N; i++) {
        uint8_t alone[64];
        int32_t level;
        oc_block_decode(&coder, &reader, decoded[i], i > 0 ? levels[i - 1] : 0, &level);
        TEST_ASSERT_EQUAL_INT32(levels[i], level);
        code_block(16, px[i], alone);
        TEST_ASSERT_EQUAL_UINT8_ARRAY(alone, decoded[i], 64);
    }
    TEST_ASSERT_EQUAL_size_t(writer.n_bits, reader.n_bits);
}

static void random_bits_never_decode_out_of_bounds(void)
{
    uint32_t state = SEED;
    int n_failed = 0;
    for (int trial = 0; trial < 2000; trial++) {
        uint8_t buf[96];
        for (size_t i = 0; i < sizeof buf; i++) {
            buf[i] = (uint8_t)(next_random(&state) | next_random(&state));
        }
        oc_block_coder_t coder;
        oc_bit_reader_t reader;
        int32_t level = 0;
        oc_block_coder_init(&coder, 1u + (unsigned)trial % 31u);
        oc_bit_reader_init(&reader, buf, sizeof buf);
        while (!reader.has_failed && reader.n_bits < reader.cap_bits) {
            uint8_t px[64];
            oc_block_decode(&coder, &reader, px, level, &level);
            TEST_ASSERT_TRUE(level >= -4095 && level <= 4095);
        }
        n_failed += reader.has_failed;
    }
    TEST_ASSERT_TRUE(n_failed > 1000);
}

static void blocks_at_the_edge_repeat_the_last_pixel(void)
{
    uint8_t image[35 * 40];
    for (int i = 0; i < 35 * 40; i++) {
        image[i] = (uint8_t)(i * 7);
    }
    const oc_image_t grey = {.px = image, .width_px = 35, .height_px = 37, .stride_bytes = 35, .channels = 1};
    uint8_t px[64];
    oc_block_cut(&grey, 4, 4, px);
    for (int y = 0; y < 8; y++) {
        for (int x = 0; x < 8; x++) {
            const int column = 32 + x < 35 ? 32 + x : 34, row = 32 + y < 37 ? 32 + y : 36;
            TEST_ASSERT_EQUAL_UINT8(image[row * 35 + column], px[y * 8 + x]);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(flat_blocks_come_back_within_half_a_step);
    RUN_TEST(blocks_agree_with_a_floating_point_transform);
    RUN_TEST(finer_quality_costs_more_and_errs_less);
    RUN_TEST(extreme_blocks_do_not_overflow);
    RUN_TEST(a_run_of_blocks_decodes_with_the_same_adaptation);
    RUN_TEST(random_bits_never_decode_out_of_bounds);
    RUN_TEST(blocks_at_the_edge_repeat_the_last_pixel);
    return UNITY_END();
}
