// SPDX-License-Identifier: BSD-3-Clause
// Planning and composing the overhead map.
#include "site/overhead.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/plane.h"
#include "site/box_shadow.h"

namespace outcrop {
namespace {

// Boxes are a little larger than what was seen of them; the ring round them is doubtful ground.
constexpr double kBoxGrowShare = 0.06;

// Samples per side of a tile when planning.
constexpr int kPlanSamples = 16;

// Samples per side of the area when choosing the scale.
constexpr int kScaleSamples = 48;

// A tile of which the best view shows less than this share is not asked for.
constexpr double kMinShare = 0.02;

// No map is larger, whatever scale a tile claims.
constexpr double kMaxMapSide = 16384;

// Over so many pixels a view fades out towards the edge of what it shows.
constexpr double kFeatherPx = 10;

constexpr double kMinGain = 0.6, kMaxGain = 1.6;
constexpr int kMinOverlapPx = 200;

// How one view sees the ground.
class GroundEye {
public:
    GroundEye(const RefinedView &view, const std::vector<Blocker> &blockers)
        : camera_(view.camera), blockers_(&blockers)
    {
        double centre[3];
        oc_pose_centre(&camera_.pose, centre);
        centre_ = Eigen::Vector3d(centre[0], centre[1], centre[2]);
    }

    // Worth of this view at a ground point: image pixels per square metre of
    // ground, 0 where the view does not show it.
    double worth(double x, double y) const
    {
        const double p[3] = {x, y, 0};
        double u, v;
        const double depth = oc_camera_project(&camera_, p, &u, &v);
        if (!(depth > 0) || !(u >= 1 && v >= 1 && u < camera_.k.width_px - 2.0 && v < camera_.k.height_px - 2.0))
            return 0;
        const Eigen::Vector3d ground(x, y, 0);
        if (is_hidden(*blockers_, centre_, ground)) return 0;
        const double distance = (ground - centre_).norm();
        const double cos_incidence = std::abs(centre_.z()) / distance;
        return camera_.k.fx_px * camera_.k.fy_px * cos_incidence / (distance * distance);
    }

private:
    oc_camera_t camera_;
    const std::vector<Blocker> *blockers_;
    Eigen::Vector3d centre_;
};

// An area may be much larger than the ground that is in sight, so what counts is how much of it any view shows.
double scale_of(const Area &area, const std::vector<GroundEye> &eyes, const OverheadOptions &options)
{
    if (options.metres_per_pixel > 0) return options.metres_per_pixel;
    const double width = area.x_max - area.x_min, height = area.y_max - area.y_min;
    int n_seen = 0;
    for (int i = 0; i < kScaleSamples * kScaleSamples; i++) {
        const double x = area.x_min + (i % kScaleSamples + 0.5) / kScaleSamples * width;
        const double y = area.y_min + (i / kScaleSamples + 0.5) / kScaleSamples * height;
        n_seen += std::any_of(eyes.begin(), eyes.end(), [&](const GroundEye &eye) { return eye.worth(x, y) > 0; });
    }
    const double share = n_seen > 0 ? n_seen / static_cast<double>(kScaleSamples * kScaleSamples) : 1;
    return std::sqrt(width * height * share) / options.pixels_per_side;
}

double farthest_of(const Area &area)
{
    return std::max({std::abs(area.x_min), std::abs(area.x_max), std::abs(area.y_min), std::abs(area.y_max)});
}

int tile_px_of(const OverheadOptions &options)
{
    if (options.tile_px > 0) return options.tile_px;
    if (options.datagram_bytes >= 1000) return 64;
    return options.datagram_bytes >= 500 ? 48 : 32;
}

// How well each view shows each sample of a tile: 0 not at all, else kSeen
// to 1 by resolution against the best view there.
class TileViews {
public:
    TileViews(oc_tile_id_t tile, double side_m, const Area &area, const std::vector<GroundEye> &eyes)
    {
        std::vector<Eigen::Vector2d> cells;
        for (int r = 0; r < kPlanSamples; r++) {
            for (int c = 0; c < kPlanSamples; c++) {
                const double x = (tile.ix + (c + 0.5) / kPlanSamples) * side_m;
                const double y = (tile.iy + (r + 0.5) / kPlanSamples) * side_m;
                if (x >= area.x_min && x <= area.x_max && y >= area.y_min && y <= area.y_max) cells.emplace_back(x, y);
            }
        }
        value_.assign(eyes.size(), std::vector<double>(cells.size()));
        for (std::size_t i = 0; i < cells.size(); i++) {
            double best = 0;
            for (std::size_t e = 0; e < eyes.size(); e++)
                best = std::max(best, value_[e][i] = eyes[e].worth(cells[i].x(), cells[i].y()));
            for (std::size_t e = 0; e < eyes.size(); e++)
                if (value_[e][i] > 0) value_[e][i] = kSeen + (1 - kSeen) * std::sqrt(value_[e][i] / best);
        }
    }

    // Share of a whole tile that a set of views shows, each sample by its best view.
    double shown(const std::vector<int> &views) const
    {
        double sum = 0;
        for (std::size_t i = 0; !value_.empty() && i < value_[0].size(); i++) {
            double best = 0;
            for (const int view : views) best = std::max(best, value_[static_cast<std::size_t>(view)][i]);
            sum += best;
        }
        return sum / (kPlanSamples * kPlanSamples);
    }

    int n_views() const { return static_cast<int>(value_.size()); }

private:
    static constexpr double kSeen = 0.7;
    std::vector<std::vector<double>> value_;
};

// The best view for one place of a set; ties go to the lower view. Returns what the set then shows.
double fill_place(const TileViews &tile, std::size_t place, std::vector<int> *views)
{
    std::vector<int> set = *views;
    double most = tile.shown(set);
    for (int view = 0; view < tile.n_views(); view++) {
        set[place] = view;
        const double shown = tile.shown(set);
        if (shown > most + 1e-12) {
            most = shown;
            (*views)[place] = view;
        }
    }
    return most;
}

// Grows the set while a further view adds enough; after each, every earlier choice is thought over again.
std::vector<int> plan_tile(const TileViews &tile, const OverheadOptions &options)
{
    std::vector<int> views;
    double shown = 0;
    while (static_cast<int>(views.size()) < std::min(options.max_views_per_tile, tile.n_views())) {
        std::vector<int> more = views;
        more.push_back(views.empty() ? 0 : views.front());
        double now = fill_place(tile, more.size() - 1, &more);
        for (std::size_t place = 0; place + 1 < more.size(); place++) now = fill_place(tile, place, &more);
        if (now - shown < (views.empty() ? kMinShare : options.min_gain)) break;
        views = more;
        shown = now;
    }
    std::sort(views.begin(), views.end());
    return views;
}

std::vector<GroundEye> eyes_of(const SiteModel &model, const std::vector<Blocker> &blockers)
{
    std::vector<GroundEye> eyes;
    for (const RefinedView &view : model.views) eyes.emplace_back(view, blockers);
    return eyes;
}

// A decoded tile on the map: its pixels, weights, and where it goes.
struct Layer {
    int view = 0; // index into the model's views
    cv::Rect place;
    cv::Mat3f rgb;
    cv::Mat1f weight;
};

// Does a WebP file say that it is as large as the tile? Asked before decoding: a few bytes may stand for a huge image.
bool is_webp_of(const std::vector<std::uint8_t> &b, int side)
{
    const auto text = [&](std::size_t at, const char *four) { return std::memcmp(b.data() + at, four, 4) == 0; };
    if (b.size() < 30 || !text(0, "RIFF") || !text(8, "WEBP")) return false;
    const auto word = [&](std::size_t at) { return b[at] | b[at + 1] << 8; };
    if (text(12, "VP8 ")) return (word(26) & 0x3fff) == side && (word(28) & 0x3fff) == side;
    if (text(12, "VP8L")) {
        const unsigned bits = static_cast<unsigned>(word(21)) | static_cast<unsigned>(word(23)) << 16;
        return static_cast<int>(bits & 0x3fff) + 1 == side && static_cast<int>(bits >> 14 & 0x3fff) + 1 == side;
    }
    return text(12, "VP8X") && word(24) + (b[26] << 16) + 1 == side && word(27) + (b[29] << 16) + 1 == side;
}

std::optional<cv::Mat3b> decode(const TileKey &key, const TileBlob &blob)
{
    if (blob.codec == OC_CODEC_WEBP && !is_webp_of(blob.bytes, key.tile_px)) return std::nullopt;
    const cv::Mat bgr = cv::imdecode(blob.bytes, cv::IMREAD_COLOR);
    if (bgr.empty() || bgr.cols != key.tile_px || bgr.rows != key.tile_px) return std::nullopt;
    cv::Mat3b rgb;
    cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
    return rgb;
}

// Weights of a tile's pixels in its view: worth, faded towards the edge of what is seen.
cv::Mat1f weigh(const TileKey &key, const GroundEye &eye, double metres_per_pixel)
{
    cv::Mat1f weight(key.tile_px, key.tile_px);
    cv::Mat1b seen(key.tile_px + 2, key.tile_px + 2, static_cast<unsigned char>(255));
    for (int r = 0; r < key.tile_px; r++) {
        for (int c = 0; c < key.tile_px; c++) {
            const double x = (key.ix * key.tile_px + c + 0.5) * metres_per_pixel;
            const double y = ((key.iy + 1) * key.tile_px - r - 0.5) * metres_per_pixel;
            const double worth = eye.worth(x, y);
            weight(r, c) = static_cast<float>(worth);
            seen(r + 1, c + 1) = worth > 0 ? 255 : 0;
        }
    }
    cv::Mat1f inside;
    cv::distanceTransform(seen, inside, cv::DIST_L2, 3);
    for (int r = 0; r < key.tile_px; r++) {
        for (int c = 0; c < key.tile_px; c++)
            weight(r, c) *= static_cast<float>(std::min(1.0, inside(r + 1, c + 1) / kFeatherPx));
    }
    return weight;
}

class Mosaic {
public:
    Mosaic(int width, int height) : sum_(height, width, cv::Vec3f(0, 0, 0)), weight_(height, width, 0.f) {}

    // Ratio of what is there to a view's layers where both show ground: its exposure gain.
    double gain_of(const std::vector<const Layer *> &layers) const
    {
        std::vector<double> ratios;
        for (const Layer *layer : layers) {
            for_each(*layer, [&](cv::Point at, cv::Point in) {
                if (weight_(at) <= 0 || layer->weight(in) <= 0) return;
                const cv::Vec3f &there = sum_(at), &here = layer->rgb(in);
                const double level = (there[0] + there[1] + there[2]) / weight_(at);
                const double own = here[0] + here[1] + here[2];
                if (level > 60 && own > 60) ratios.push_back(level / own);
            });
        }
        if (ratios.size() < kMinOverlapPx) return 1;
        const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
        std::nth_element(ratios.begin(), middle, ratios.end());
        return std::clamp(*middle, kMinGain, kMaxGain);
    }

    void add(const Layer &layer, double gain)
    {
        for_each(layer, [&](cv::Point at, cv::Point in) {
            const float weight = layer.weight(in);
            if (weight <= 0) return;
            sum_(at) += layer.rgb(in) * static_cast<float>(gain * weight);
            weight_(at) += weight;
        });
    }

    void finish(double gain, OverheadMap *map) const
    {
        map->rgb = cv::Mat3b(sum_.size(), cv::Vec3b(0, 0, 0));
        map->seen = cv::Mat1b(sum_.size(), static_cast<unsigned char>(0));
        for (int y = 0; y < sum_.rows; y++) {
            for (int x = 0; x < sum_.cols; x++) {
                if (weight_(y, x) <= 0) continue;
                for (int c = 0; c < 3; c++)
                    map->rgb(y, x)[c] = cv::saturate_cast<unsigned char>(gain * sum_(y, x)[c] / weight_(y, x));
                map->seen(y, x) = 255;
            }
        }
    }

private:
    template <typename Visit>
    void for_each(const Layer &layer, Visit visit) const
    {
        const cv::Rect inside = layer.place & cv::Rect(0, 0, weight_.cols, weight_.rows);
        for (int y = inside.y; y < inside.br().y; y++) {
            for (int x = inside.x; x < inside.br().x; x++)
                visit(cv::Point(x, y), cv::Point(x - layer.place.x, y - layer.place.y));
        }
    }

    cv::Mat3f sum_;
    cv::Mat1f weight_;
};

bool is_scale_for(const Area &area, double scale)
{
    const double side = std::max(area.x_max - area.x_min, area.y_max - area.y_min);
    return scale > 0 && side / scale <= kMaxMapSide && farthest_of(area) / scale < 1e9;
}

// Of several scales (an older plan's tiles may be among them) the one with the most tiles counts; tiles whose scale
// would make a map out of all measure count as bad.
double scale_of_tiles(const Area &area, const std::map<TileKey, TileBlob> &tiles, double otherwise, int *n_bad)
{
    std::map<double, int> scales;
    for (const auto &[key, blob] : tiles) {
        if (is_scale_for(area, key.metres_per_pixel)) {
            scales[key.metres_per_pixel]++;
        } else {
            ++*n_bad;
        }
    }
    double scale = is_scale_for(area, otherwise) ? otherwise : 1; // 1: an area without extent
    int most = 0;
    for (const auto &[candidate, n] : scales) {
        if (n > most) scale = candidate;
        most = std::max(most, n);
    }
    return scale;
}

} // namespace

void OverheadOptions::check() const
{
    if (!(metres_per_pixel >= 0) || pixels_per_side < 16 || pixels_per_side > 8192)
        throw std::invalid_argument("overhead: the map's scale is out of range");
    if (tile_px != 0 && (tile_px < 16 || tile_px > 256))
        throw std::invalid_argument("overhead: tile_px is not within 16..256");
    if (quality < 1 || quality > 100 || max_views_per_tile < 1 || !(min_gain > 0))
        throw std::invalid_argument("overhead: quality, max_views_per_tile or min_gain is out of range");
}

std::vector<TileRequest> plan_overhead(const SiteModel &model, const OverheadOptions &options)
{
    options.check();
    const Area &area = model.area;
    const std::vector<Blocker> blockers = blockers_of(model, kBoxGrowShare);
    const std::vector<GroundEye> eyes = eyes_of(model, blockers);
    const auto scale = static_cast<double>(static_cast<float>(scale_of(area, eyes, options))); // as it will travel
    const int tile_px = tile_px_of(options);
    const double side_m = tile_px * scale;

    std::vector<TileRequest> out(model.views.size());
    for (std::size_t i = 0; i < out.size(); i++) {
        out[i].view = model.views[i].id;
        oc_plane_image_from_ground(&model.views[i].camera, out[i].image_from_ground.data());
        out[i].metres_per_pixel = scale;
        out[i].tile_px = tile_px;
        out[i].quality = options.quality;
    }
    if (!(farthest_of(area) < 32767 * side_m)) return {}; // tiles are numbered with 16 bits
    const auto first = [&](double low) { return static_cast<int>(std::floor(low / side_m)); };
    for (int iy = first(area.y_min); iy * side_m < area.y_max; iy++) {
        for (int ix = first(area.x_min); ix * side_m < area.x_max; ix++) {
            const oc_tile_id_t tile{static_cast<std::int16_t>(ix), static_cast<std::int16_t>(iy)};
            for (const int view : plan_tile(TileViews(tile, side_m, area, eyes), options))
                out[static_cast<std::size_t>(view)].tiles.push_back(tile);
        }
    }
    out.erase(std::remove_if(out.begin(), out.end(), [](const TileRequest &r) { return r.tiles.empty(); }), out.end());
    return out;
}

OverheadMap compose_overhead(const SiteModel &model, const std::map<TileKey, TileBlob> &tiles,
                             const OverheadOptions &options, int *n_bad_tiles)
{
    options.check();
    const std::vector<Blocker> blockers = blockers_of(model, kBoxGrowShare);
    const std::vector<GroundEye> eyes = eyes_of(model, blockers);
    int n_bad = 0;
    const double scale = scale_of_tiles(model.area, tiles, scale_of(model.area, eyes, options), &n_bad);
    const Area &area = model.area;
    const int left = static_cast<int>(std::floor(area.x_min / scale));
    const int top = static_cast<int>(std::ceil(area.y_max / scale));
    const int width = std::max(1, static_cast<int>(std::ceil(area.x_max / scale)) - left);
    const int height = std::max(1, top - static_cast<int>(std::floor(area.y_min / scale)));

    std::vector<std::vector<Layer>> layers(model.views.size());
    for (const auto &[key, blob] : tiles) {
        const auto view = std::find_if(model.views.begin(), model.views.end(),
                                       [k = key.view](const RefinedView &v) { return v.id == k; });
        if (key.metres_per_pixel != scale || view == model.views.end()) continue;
        const auto rgb = decode(key, blob);
        if (!rgb) {
            n_bad++;
            continue;
        }
        Layer layer;
        layer.view = static_cast<int>(view - model.views.begin());
        layer.place = cv::Rect(key.ix * key.tile_px - left, top - (key.iy + 1) * key.tile_px, key.tile_px, key.tile_px);
        rgb->convertTo(layer.rgb, CV_32FC3);
        layer.weight = weigh(key, eyes[static_cast<std::size_t>(layer.view)], scale);
        layers[static_cast<std::size_t>(layer.view)].push_back(std::move(layer));
    }
    // The view that shows most comes first; the others follow its exposure, and in the end their mean is kept.
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < layers.size(); i++) {
        if (!layers[i].empty()) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return layers[a].size() > layers[b].size(); });
    Mosaic mosaic(width, height);
    double log_gains = 0;
    for (const std::size_t i : order) {
        std::vector<const Layer *> mine;
        for (const Layer &layer : layers[i]) mine.push_back(&layer);
        const double gain = mosaic.gain_of(mine);
        for (const Layer *layer : mine) mosaic.add(*layer, gain);
        log_gains += static_cast<double>(mine.size()) * std::log(gain);
    }
    OverheadMap map;
    map.metres_per_pixel = scale;
    map.x_min = left * scale;
    map.y_max = top * scale;
    std::size_t n_layers = 0;
    for (const auto &list : layers) n_layers += list.size();
    mosaic.finish(n_layers > 0 ? std::exp(-log_gains / static_cast<double>(n_layers)) : 1, &map);
    if (n_bad_tiles) *n_bad_tiles = n_bad;
    return map;
}

} // namespace outcrop
