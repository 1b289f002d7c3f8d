// SPDX-License-Identifier: BSD-3-Clause
// Readable LCM types on the base's own network, for lcm-spy and other programs.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "site/view.h"

namespace lcm {
class LCM;
}

namespace outcrop {

class Republisher {
public:
    // Throws std::runtime_error with one line when the URL cannot be opened.
    explicit Republisher(const std::string &url);
    // On an LCM object that is open already.
    explicit Republisher(std::shared_ptr<lcm::LCM> lcm);
    ~Republisher();
    Republisher(const Republisher &) = delete;
    Republisher &operator=(const Republisher &) = delete;

    // Publish a view once (outcrop.view_t on OUTCROP_VIEW); later calls with the same view are ignored.
    void publish(int vehicle, const View &view);

private:
    std::shared_ptr<lcm::LCM> lcm_;
    std::set<int> published_;
};

} // namespace outcrop
