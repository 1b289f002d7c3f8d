# SPDX-License-Identifier: BSD-3-Clause
"""LCM logs and the bytes they cost, written from docs/protocol.md and LCM's own description, not from our readers."""
import struct

SYNC = 0xEDA1DA01
LAYERS = {1: "view", 2: "patch", 3: "silhouette", 4: "texture", 5: "overhead", 6: "status", 7: "view", 8: "view",
          9: "image", 16: "request", 17: "request", 18: "request", 19: "request", 20: "request"}


def events(data):
    """(offset, channel, payload) of a log without faults."""
    at = 0
    while at < len(data):
        sync, _, _, n_channel, n_payload = struct.unpack_from(">IqqII", data, at)
        assert sync == SYNC, at
        channel = data[at + 28:at + 28 + n_channel].decode()
        yield at, channel, data[at + 28 + n_channel:at + 28 + n_channel + n_payload]
        at += 28 + n_channel + n_payload
    assert at == len(data)


def bytes_by_layer(data):
    """{layer: (messages, bytes, bytes with UDP and IPv4)}; the type is in the packet's first byte."""
    out = {}
    for _, channel, payload in events(data):
        layer = LAYERS[payload[10] & 31]
        cost = len(payload) + len(channel) + 1 + 8
        n, bytes_lcm, bytes_ip = out.get(layer, (0, 0, 0))
        out[layer] = n + 1, bytes_lcm + cost, bytes_ip + cost + 28
    return out
