// SPDX-License-Identifier: BSD-3-Clause
// One thread: what arrived, then what is due. Receiving goes on in liblcm's own thread while the model is solved.
#include "live.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "ledger.h"
#include "link_lcm.h"
#include "output.h"
#include "republish.h"
#include "session.h"
#include "wire_log.h"

namespace outcrop {
namespace {

constexpr int kStepMs = 50;

volatile std::sig_atomic_t g_is_stopped = 0;

void on_signal(int)
{
    g_is_stopped = 1;
}

double now_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::int64_t utime_us()
{
    using std::chrono::duration_cast;
    return duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

void say(const std::string &text)
{
    std::printf("outcrop-base: %s\n", text.c_str());
    std::fflush(stdout);
}

struct LinkDelete {
    void operator()(oc_link_t *link) const { oc_link_close(link); }
};

class Live {
public:
    explicit Live(const oc_base_config_t &config);
    void run();

private:
    static void on_packet(void *user, const std::uint8_t *packet, std::size_t n_bytes);
    void open_journal(const std::string &path);
    void receive(const std::uint8_t *packet, std::size_t n_bytes);
    void take(const std::uint8_t *packet, std::size_t n_bytes);
    void send(const std::uint8_t *packet, std::size_t n_bytes);
    void record(const char *channel, const std::uint8_t *packet, std::size_t n_bytes);
    void tell_news();
    void write();
    void write_on_leaving();

    oc_base_config_t config_;
    OutputOptions output_;
    Ledger ledger_;
    ReceiveCounts counts_;
    std::unique_ptr<LogWriter> log_;
    std::unique_ptr<Republisher> republisher_;
    std::unique_ptr<Session> session_;
    std::unique_ptr<oc_link_t, LinkDelete> link_;
    std::size_t n_told_ = 0;
};

Live::Live(const oc_base_config_t &config) : config_(config)
{
    output_.dir = config.out;
    output_.represent = config.represent;
    output_.path = config.path;
    output_.method = config.method;
    output_.with_textures = config.with_textures;
    check_output(output_);
    if (config.lan_url[0]) republisher_ = std::make_unique<Republisher>(config.lan_url);

    SessionOptions options = session_options(output_);
    options.vehicle = config.vehicle;
    options.datagram_bytes = config.datagram_bytes;
    options.overhead.datagram_bytes = config.datagram_bytes;
    options.shapes.datagram_bytes = config.datagram_bytes;
    options.patch_quality = static_cast<int>(config.patch_quality);
    if (config.has_area)
        options.area = Area{config.area[0], config.area[1], config.area[2], config.area[3], config.area[4]};
    session_ = std::make_unique<Session>(options, [this](const std::uint8_t *p, std::size_t n) { send(p, n); });

    char error[512];
    link_.reset(oc_link_open(config.up_url, OC_CHANNEL_UP, config.down_url, OC_CHANNEL_DOWN, on_packet, this, error,
                             sizeof error));
    if (!link_) throw std::runtime_error(error);
    // Last, so that a start that failed leaves nothing behind.
    std::filesystem::create_directories(output_.dir);
    std::filesystem::remove(output_.dir + "/report.json"); // the sign of a finished run
    open_journal(output_.dir + "/link.lcm");
}

// What an earlier base wrote down before it ended is taken in as if it came now.
void Live::open_journal(const std::string &path)
{
    std::error_code none;
    if (!config_.resume || !std::filesystem::exists(path) || std::filesystem::file_size(path, none) == 0) {
        log_ = std::make_unique<LogWriter>(path);
        return;
    }
    const LogFaults read = read_log(path, [this](const LogEvent &event) {
        if (event.channel != OC_CHANNEL_DOWN && event.channel != OC_CHANNEL_UP) return;
        ledger_.add(event.channel, event.payload.data(), event.payload.size());
        if (event.channel != OC_CHANNEL_DOWN) return;
        std::size_t n_bytes = 0;
        const std::uint8_t *packet = oc_link_unwrap(event.payload.data(), event.payload.size(), &n_bytes);
        if (packet) take(packet, n_bytes);
    });
    counts_.garbage_bytes = read.garbage_bytes;
    session_->resume();
    log_ = std::make_unique<LogWriter>(path, read);
    say("went on from " + path + ": " + std::to_string(read.n_events) + " messages" +
        (read.is_cut ? ", the last one was cut" : ""));
}

void Live::record(const char *channel, const std::uint8_t *packet, std::size_t n_bytes)
{
    std::uint8_t payload[OC_MAX_DATAGRAM_BYTES + OC_LCM_PAYLOAD_BYTES];
    const std::size_t payload_bytes = oc_link_wrap(packet, n_bytes, payload);
    log_->write(utime_us(), channel, payload, payload_bytes);
    ledger_.add(channel, payload, payload_bytes);
}

void Live::on_packet(void *user, const std::uint8_t *packet, std::size_t n_bytes)
{
    static_cast<Live *>(user)->receive(packet, n_bytes);
}

void Live::receive(const std::uint8_t *packet, std::size_t n_bytes)
{
    record(OC_CHANNEL_DOWN, packet, n_bytes);
    take(packet, n_bytes);
}

void Live::take(const std::uint8_t *packet, std::size_t n_bytes)
{
    const FeedResult result = session_->receive(packet, n_bytes, now_s());
    if (result == FeedResult::kIllFormed) counts_.ill_formed++;
    if (result == FeedResult::kForeign) counts_.foreign++;
}

void Live::send(const std::uint8_t *packet, std::size_t n_bytes)
{
    if (oc_link_send(link_.get(), packet, n_bytes)) record(OC_CHANNEL_UP, packet, n_bytes);
}

void Live::tell_news()
{
    const auto &views = session_->views();
    if (views.size() == n_told_) return;
    n_told_ = views.size();
    say(std::to_string(n_told_) + " views, " + std::to_string(ledger_.total().bytes) + " bytes so far");
    if (!republisher_) return;
    for (const auto &[id, view] : views) republisher_->publish(session_->vehicle(), view);
}

void Live::write()
{
    ReceiveCounts counts = counts_;
    counts.ill_formed += oc_link_get_counts(link_.get()).ill_formed;
    write_output(*session_, ledger_, counts, output_, say);
    say("settled: " + std::to_string(ledger_.total().bytes) + " bytes on the link, " + output_.dir + " written");
}

void Live::run()
{
    say("ready");
    bool is_written = false;
    while (!g_is_stopped) {
        if (oc_link_handle(link_.get(), kStepMs) < 0 && !g_is_stopped) throw std::runtime_error("the link failed");
        session_->step(now_s());
        tell_news();
        if (!session_->is_settled()) {
            is_written = false;
        } else if (!is_written) {
            write();
            is_written = true;
            if (config_.exit_when_settled) return;
        }
    }
    if (!is_written) write_on_leaving();
}

// A signal before all has come: what there is is still worth having.
void Live::write_on_leaving()
{
    session_->settle();
    if (session_->views().empty()) {
        say("ended before any view was complete, nothing written");
        return;
    }
    say("ended before all had come, writing what there is");
    write();
}

} // namespace

void run_live(const oc_base_config_t &config)
{
    std::signal(SIGTERM, on_signal);
    std::signal(SIGINT, on_signal);
    Live(config).run();
}

} // namespace outcrop
