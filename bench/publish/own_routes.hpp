// Our own publishing, exactly as the daemon does it and as a user's program receives it.
#pragma once

#include <filesystem>

#include "bench/support/exchange.hpp"

namespace tubed {

/// DdsPublisher to TubeSubscriber: conversion, contract, sequence guard and all.
Route own_udp();

/// The same with DDS Security on, with keys of `room` as `tubectl keys make-room` makes them.
Route own_udp_secured(const std::filesystem::path& room);

/// ShmPublisher to ShmTubeReader, by a socket in `folder`.
Route own_shared_memory(const std::filesystem::path& folder);

}  // namespace tubed
