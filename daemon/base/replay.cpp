// SPDX-License-Identifier: BSD-3-Clause
// Downlink packets go to the session, uplink ones only to the ledger.
#include "replay.h"

#include <filesystem>
#include <stdexcept>

#include "link_lcm.h"
#include "wire_log.h"

namespace outcrop {

void run_replay(const ReplayOptions &options, const Progress &progress)
{
    check_output(options.output);
    SessionOptions session_opts = session_options(options.output);
    session_opts.vehicle = options.vehicle;
    session_opts.area = options.area;
    Session session(session_opts, {});
    Ledger ledger;
    ReceiveCounts counts;
    const LogFaults faults = read_log(options.log, [&](const LogEvent &event) {
        if (event.channel != OC_CHANNEL_DOWN && event.channel != OC_CHANNEL_UP) return;
        ledger.add(event.channel, event.payload.data(), event.payload.size());
        if (event.channel != OC_CHANNEL_DOWN) return;
        std::size_t n_bytes = 0;
        const std::uint8_t *packet = oc_link_unwrap(event.payload.data(), event.payload.size(), &n_bytes);
        const FeedResult result = packet ? session.receive(packet, n_bytes, static_cast<double>(event.utime_us) * 1e-6)
                                         : FeedResult::kIllFormed;
        if (result == FeedResult::kIllFormed) counts.ill_formed++;
        if (result == FeedResult::kForeign) counts.foreign++;
    });
    counts.garbage_bytes = faults.garbage_bytes;
    counts.is_log_cut = faults.is_cut;
    if (faults.is_cut) progress(options.log + ": the last event is cut, went on without it");
    if (faults.garbage_bytes)
        progress(options.log + ": skipped " + std::to_string(faults.garbage_bytes) + " bytes of garbage");
    session.settle();
    if (session.views().empty()) throw std::runtime_error(options.log + ": holds no complete view");
    write_output(session, ledger, counts, options.output, progress);
}

} // namespace outcrop
