#include "tests/second_aurora/port_table.hpp"

#include <algorithm>

namespace tubed::second_aurora {

namespace {
constexpr int kFirstHandle = 0x0A;
}  // namespace

PortTable::PortTable(const Settings& settings) : settings_(settings), tools_(settings.ports) {}

void PortTable::forget_handles() {
  handles_.clear();
  highest_number_ = kFirstHandle - 1;
}

void PortTable::allocate_missing() {
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    const int port = static_cast<int>(i) + 1;
    if (!tools_[i]) {
      continue;
    }
    const bool has_one = std::any_of(handles_.begin(), handles_.end(), [port](const Handle& handle) {
      return handle.port == port && handle.channel == 0 && handle.occupied;
    });
    if (!has_one) {
      Handle& handle = allocate(port, 0);
      handle.occupied = true;
      handle.tool = *tools_[i];
    }
  }
}

void PortTable::plug(int port, const Tool& tool) { tools_.at(static_cast<std::size_t>(port - 1)) = tool; }

void PortTable::unplug(int port, bool tracking) {
  tools_.at(static_cast<std::size_t>(port - 1)).reset();
  for (Handle& handle : handles_) {
    if (handle.port == port && handle.occupied) {
      handle.occupied = handle.initialised = handle.enabled = false;
      handle.lost_while_tracking = tracking;
      handle.written_blocks = 0;
    }
  }
}

void PortTable::tracking_starts() {
  for (Handle& handle : handles_) {
    handle.lost_while_tracking = false;
  }
}

Handle* PortTable::find(int number) {
  const auto found = std::find_if(handles_.begin(), handles_.end(),
                                  [number](const Handle& handle) { return handle.number == number; });
  return found == handles_.end() ? nullptr : &*found;
}

std::vector<const Handle*> PortTable::list(HandleQuery query) const {
  const auto wanted = [query](const Handle& handle) {
    switch (query) {
      case HandleQuery::ToBeFreed:
        return !handle.occupied;
      case HandleQuery::Uninitialised:
        return handle.occupied && !handle.initialised;
      case HandleQuery::Initialised:
        return handle.initialised && !handle.enabled;
      case HandleQuery::Enabled:
        return handle.enabled;
      case HandleQuery::All:
        break;
    }
    return true;
  };
  std::vector<const Handle*> listed;
  for (const Handle& handle : handles_) {
    if (wanted(handle)) {
      listed.push_back(&handle);
    }
  }
  std::sort(listed.begin(), listed.end(),
            [](const Handle* a, const Handle* b) { return a->number < b->number; });
  return listed;
}

int PortTable::status_of(const Handle& handle) const {
  if (!handle.occupied) {
    return 0;
  }
  if (!handle.initialised) {
    return settings_.firmware.status_before_pinit;
  }
  return 0x11 | (handle.enabled ? 0x20 : 0) | static_cast<int>(settings_.firmware.extra_port_status & 0xE);
}

void PortTable::free(int number) {
  std::erase_if(handles_, [number](const Handle& handle) { return handle.number == number; });
}

int PortTable::request(int port, int channel) {
  if (port != 0) {
    if (const Handle* existing = of_coil(port, channel)) {
      return existing->number;
    }
  }
  return allocate(port, channel).number;
}

void PortTable::initialise(const Handle& handle) {
  // A copy: allocating moves the handles.
  const Handle first = handle;
  for (int channel = 0; channel < first.tool.coils; ++channel) {
    Handle* coil = of_coil(first.port, channel);
    if (coil == nullptr) {
      coil = &allocate(first.port, channel);
    }
    coil->occupied = coil->initialised = true;
    coil->tool = first.tool;
  }
}

Handle& PortTable::allocate(int port, int channel) {
  int number = highest_number_ + 1;
  if (settings_.firmware.freed_numbers_are_reused) {
    number = kFirstHandle;
    while (find(number) != nullptr) {
      ++number;
    }
  }
  highest_number_ = std::max(highest_number_, number);
  Handle handle;
  handle.number = number;
  handle.port = port;
  handle.channel = channel;
  handles_.push_back(handle);
  return handles_.back();
}

Handle* PortTable::of_coil(int port, int channel) {
  const auto found = std::find_if(handles_.begin(), handles_.end(), [port, channel](const Handle& handle) {
    return handle.port == port && handle.channel == channel && handle.occupied;
  });
  return found == handles_.end() ? nullptr : &*found;
}

}  // namespace tubed::second_aurora
