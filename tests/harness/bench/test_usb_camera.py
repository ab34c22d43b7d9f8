"""A camera that no driver reads is refused in one sentence that says how to serve it."""

import pytest
from pydantic import ValidationError

from harness.bench.instruments.cameras import CameraSection, GelSection


@pytest.mark.parametrize("url", ["/dev/video0", "0", "usb:0", "rtsp://10.0.0.2/live"])
def test_an_address_that_is_no_http_stream_is_refused(url: str) -> None:
    for section in (GelSection, CameraSection):
        with pytest.raises(ValidationError, match=r"address.*ustreamer "):
            section.model_validate({"url": url, "calibration": "gelsight_r15_bench"})


@pytest.mark.parametrize("kind", ["usb", "v4l2", "realsense", 3])
def test_a_kind_without_a_driver_is_refused(kind: object) -> None:
    for section in (GelSection, CameraSection):
        with pytest.raises(ValidationError, match=r"kind.*ustreamer "):
            section.model_validate({"kind": kind, "calibration": "gelsight_r15_bench"})


@pytest.mark.parametrize(
    "url", ["http://gsr15001.local:8080/?action=stream", "https://10.0.0.2/stream", None]
)
def test_a_stream_over_http_is_accepted(url: str | None) -> None:
    assert GelSection.model_validate({"url": url, "calibration": "gelsight_r15_bench"}).url == url
