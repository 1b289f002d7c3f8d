// SPDX-License-Identifier: BSD-3-Clause
// A network of one's own: LCM's multicast without a packet leaving this process tree.
#pragma once

namespace outcrop {

// Move this process into a fresh (user and) network namespace with lo up and a
// multicast route on lo. Throws std::runtime_error with one line where the
// system refuses. Call it before any thread is started.
void enter_private_net();

} // namespace outcrop
