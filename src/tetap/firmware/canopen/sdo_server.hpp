// SPDX-License-Identifier: Apache-2.0
// The server's side of the service data objects of CiA 301: expedited and segmented transfers, one at a time. It knows
// no object. A block transfer is refused, so that a client takes segments.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::firmware::canopen {

/// Codes of an abort on the bus; the first two never go there.
enum class Abort : std::uint32_t {
  kNone = 0,
  kPending = 1,  ///< a write whose end comes later
  kToggle = 0x05030000,
  kTimeout = 0x05040000,
  kCommand = 0x05040001,
  kNoAccess = 0x06010000,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kIncompatible = 0x06040043,
  kTooLong = 0x06070012,
  kTooShort = 0x06070013,
  kNoSubindex = 0x06090011,
  kOutOfRange = 0x06090030,
  kTooHigh = 0x06090031,
  kTooLow = 0x06090032,
  kNotStored = 0x08000020,
  kLocalControl = 0x08000021,
  kDeviceState = 0x08000022,
};

struct Object {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend constexpr bool operator==(const Object&, const Object&) = default;
};

/// Value of an object, least significant byte first.
struct Content {
  static constexpr std::size_t kMost = 16;
  std::array<std::uint8_t, kMost> bytes{};
  std::size_t size = 0;

  void add(std::uint64_t value, std::size_t count) {
    for (std::size_t i = 0; i < count && size < kMost; ++i) bytes[size++] = static_cast<std::uint8_t>(value >> (8 * i));
  }
  void add(const char* text) {
    while (*text != '\0' && size < kMost) bytes[size++] = static_cast<std::uint8_t>(*text++);
  }
  [[nodiscard]] std::span<const std::uint8_t> view() const { return std::span(bytes).first(size); }
};

/// Objects of a node. A write of kPending ends by SdoServer::finish().
template <class O>
concept ObjectDictionary = requires(O& objects, Object object, Content& content, std::span<const std::uint8_t> data) {
  { objects.read(object, content) } -> std::same_as<Abort>;
  { objects.write(object, data) } -> std::same_as<Abort>;
};

class SdoServer {
 public:
  /// Requests come with 0x600 + node_id, responses go out with `response_id`.
  explicit SdoServer(std::uint32_t response_id) : response_id_(response_id) {}

  [[nodiscard]] static Object object_of(const base::CanFrame& request) {
    return {static_cast<std::uint16_t>(request.data[1] | request.data[2] << 8), request.data[3]};
  }
  /// A write waits for its end; no request may come before it.
  [[nodiscard]] bool is_writing() const { return state_ == State::kWriting; }

  template <ObjectDictionary Objects, class Send>
  [[gnu::cold]] void on_request(const base::CanFrame& request, base::Micros now, Objects& objects, Send&& send) {
    if (request.size != 8) return;
    const auto& data = request.data;
    const Object object = object_of(request);
    heard_ = now;
    switch (data[0] >> 5) {
      case kDownloadSegment:
        return download_segment(data, objects, send);
      case kDownload:
        begin(object, send);
        return download(data, objects, send);
      case kUpload:
        begin(object, send);
        return upload(objects, send);
      case kUploadSegment:
        return upload_segment(data[0], send);
      case kAbort:
        if (object == object_) state_ = State::kIdle;
        return;
      default:
        begin(object, send);
        return end_with(Abort::kCommand, send);
    }
  }
  /// The end of a write.
  template <class Send>
  void finish(Abort why, Send&& send) {
    if (why != Abort::kNone) return end_with(why, send);
    state_ = State::kIdle;
    if (segmented_)
      respond(send, static_cast<std::uint8_t>(kDownloadSegmentDone | toggle_ << 4), {});
    else
      respond_with_object(send, kDownloadDone, 0);
  }
  /// A transfer whose client is silent ends.
  template <class Send>
  void give_up(base::Micros now, Send&& send) {
    if (state_ != State::kIdle && now - heard_ > kPatience) end_with(Abort::kTimeout, send);
  }

 private:
  enum class State : std::uint8_t { kIdle, kUploading, kDownloading, kWriting };
  static constexpr base::Micros kPatience{1'000'000};
  // Commands of a client, in the upper three bits of byte 0, and of the server as byte 0.
  static constexpr std::uint8_t kDownloadSegment = 0, kDownload = 1, kUpload = 2, kUploadSegment = 3, kAbort = 4;
  static constexpr std::uint8_t kDownloadSegmentDone = 0x20, kDownloadDone = 0x60, kAborted = 0x80;
  static constexpr std::uint8_t kUploadExpedited = 0x43, kUploadSegmented = 0x41;
  static constexpr std::size_t kSegment = 7;
  using Data = std::array<std::uint8_t, 8>;

  /// An open transfer of another object is another client's: an abort ends it.
  template <class Send>
  void begin(Object object, Send& send) {
    if (state_ != State::kIdle && object != object_) end_with(Abort::kDeviceState, send);
    state_ = State::kIdle;
    object_ = object;
    content_ = {};
    at_ = announced_ = 0;
    toggle_ = 0;
    segmented_ = false;
  }

  template <class Objects, class Send>
  void upload(Objects& objects, Send& send) {
    const Abort why = objects.read(object_, content_);
    if (why != Abort::kNone) return end_with(why, send);
    if (content_.size <= 4) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < content_.size; ++i) value |= std::uint32_t{content_.bytes[i]} << (8 * i);
      return respond_with_object(send, static_cast<std::uint8_t>(kUploadExpedited | (4 - content_.size) << 2), value);
    }
    state_ = State::kUploading;
    respond_with_object(send, kUploadSegmented, static_cast<std::uint32_t>(content_.size));
  }
  template <class Send>
  void upload_segment(std::uint8_t command, Send& send) {
    if (state_ != State::kUploading) return end_with(Abort::kCommand, send);
    if ((command >> 4 & 1U) != toggle_) return end_with(Abort::kToggle, send);
    const std::size_t left = content_.size - at_, size = left < kSegment ? left : kSegment;
    const bool last = left <= kSegment;
    respond(send, static_cast<std::uint8_t>(std::size_t{toggle_} << 4 | (kSegment - size) << 1 | (last ? 1U : 0U)),
            content_.view().subspan(at_, size));
    at_ += size;
    toggle_ ^= 1U;
    if (last) state_ = State::kIdle;
  }

  template <class Objects, class Send>
  void download(const Data& data, Objects& objects, Send& send) {
    const bool expedited = (data[0] & 2U) != 0, sized = (data[0] & 1U) != 0;
    if (expedited) return write(std::span(data).subspan(4, sized ? 4U - (data[0] >> 2 & 3U) : 4U), objects, send);
    if (sized)
      for (std::size_t i = 0; i < 4; ++i) announced_ |= std::uint32_t{data[4 + i]} << (8 * i);
    if (announced_ > Content::kMost) return end_with(Abort::kTooLong, send);
    segmented_ = true;
    state_ = State::kDownloading;
    respond_with_object(send, kDownloadDone, 0);
  }
  template <class Objects, class Send>
  void download_segment(const Data& data, Objects& objects, Send& send) {
    if (state_ != State::kDownloading) return end_with(Abort::kCommand, send);
    if ((data[0] >> 4 & 1U) != toggle_) return end_with(Abort::kToggle, send);
    const std::size_t size = kSegment - (std::size_t{data[0]} >> 1 & 7U);
    if (content_.size + size > Content::kMost) return end_with(Abort::kTooLong, send);
    for (std::size_t i = 0; i < size; ++i) content_.bytes[content_.size++] = data[1 + i];
    if ((data[0] & 1U) == 0) {
      respond(send, static_cast<std::uint8_t>(kDownloadSegmentDone | toggle_ << 4), {});
      toggle_ ^= 1U;
      return;
    }
    if (announced_ != 0 && announced_ != content_.size)
      return end_with(content_.size > announced_ ? Abort::kTooLong : Abort::kTooShort, send);
    write(content_.view(), objects, send);
  }
  template <class Objects, class Send>
  void write(std::span<const std::uint8_t> value, Objects& objects, Send& send) {
    const Abort why = objects.write(object_, value);
    if (why == Abort::kPending)
      state_ = State::kWriting;
    else
      finish(why, send);
  }

  template <class Send>
  void end_with(Abort why, Send& send) {
    state_ = State::kIdle;
    respond_with_object(send, kAborted, static_cast<std::uint32_t>(why));
  }
  template <class Send>
  void respond_with_object(Send& send, std::uint8_t command, std::uint32_t value) const {
    const std::array<std::uint8_t, 7> rest{static_cast<std::uint8_t>(object_.index),
                                           static_cast<std::uint8_t>(object_.index >> 8),
                                           object_.sub,
                                           static_cast<std::uint8_t>(value),
                                           static_cast<std::uint8_t>(value >> 8),
                                           static_cast<std::uint8_t>(value >> 16),
                                           static_cast<std::uint8_t>(value >> 24)};
    respond(send, command, rest);
  }
  template <class Send>
  void respond(Send& send, std::uint8_t command, std::span<const std::uint8_t> rest) const {
    base::CanFrame response{.id = response_id_, .size = 8};
    response.data[0] = command;
    for (std::size_t i = 0; i < rest.size(); ++i) response.data[1 + i] = rest[i];
    send(response);
  }

  std::uint32_t response_id_;
  Content content_;
  base::Micros heard_;
  std::size_t at_ = 0;           ///< bytes of the content that are uploaded
  std::uint32_t announced_ = 0;  ///< size that a segmented download began with; 0: none
  Object object_;
  State state_ = State::kIdle;
  std::uint8_t toggle_ = 0;
  bool segmented_ = false;
};

}  // namespace tetap::firmware::canopen
