"""What a private PipeWire is told to be: one null sink, one microphone, at one rate."""

from pathlib import Path

MICROPHONE = "mock_microphone"
SPEAKER = "mock_speaker"

_POSITIONS = {1: ("MONO",), 2: ("FL", "FR")}

# A daemon with no devices of its own. Names of modules and factories are PipeWire's.
_DAEMON = """
context.properties = {{
    core.daemon = true
    core.name = pipewire-0
    support.dbus = false
    default.clock.rate = {rate}
    default.clock.allowed-rates = [ {rate} ]
    default.clock.quantum = {quantum}
    default.clock.min-quantum = {quantum}
    default.clock.max-quantum = {quantum}
}}
context.spa-libs = {{
    audio.convert.* = audioconvert/libspa-audioconvert
    support.* = support/libspa-support
}}
context.modules = [
    {{ name = libpipewire-module-protocol-native }}
    {{ name = libpipewire-module-metadata }}
    {{ name = libpipewire-module-spa-node-factory }}
    {{ name = libpipewire-module-client-node }}
    {{ name = libpipewire-module-client-device }}
    {{ name = libpipewire-module-access }}
    {{ name = libpipewire-module-adapter }}
    {{ name = libpipewire-module-link-factory }}
    {{ name = libpipewire-module-session-manager }}
]
context.objects = [
    {{ factory = metadata args = {{ metadata.name = default }} }}
    {{ factory = adapter args = {{
        factory.name = support.null-audio-sink
        node.name = {speaker}
        media.class = Audio/Sink
        audio.rate = {rate}
        audio.position = [ {positions} ]
        monitor.channel-volumes = false
        node.pause-on-idle = false
        priority.driver = 30000
    }} }}
    {{ factory = adapter args = {{
        factory.name = support.null-audio-sink
        node.name = {microphone}
        media.class = Audio/Source/Virtual
        audio.rate = {rate}
        audio.position = [ {positions} ]
        node.pause-on-idle = false
        priority.driver = 20000
    }} }}
]
"""

# PortAudio's list of ALSA devices must end with one named "default" or it stops the program
# by an assertion (libportaudio 19.6, BuildDeviceList).
_DEVICES = """
pcm.{microphone} {{
    type pipewire server "{socket}" capture_node "{microphone}" playback_node "-1"
    rate {rate} channels {channels} format "S32_LE" hint {{ show on description "mocked microphone" }}
}}
pcm.{speaker} {{
    type pipewire server "{socket}" playback_node "{speaker}" capture_node "-1"
    rate {rate} channels {channels} format "S32_LE" hint {{ show on description "mocked speaker" }}
}}
pcm.default {{ type null }}
"""


def settings(rate: int, channels: int, quantum: int) -> str:
    """PipeWire's configuration file."""
    return _DAEMON.format(
        rate=rate,
        quantum=quantum,
        positions=" ".join(_POSITIONS[channels]),
        speaker=SPEAKER,
        microphone=MICROPHONE,
    )


def sound_devices(socket: Path, rate: int, channels: int) -> str:
    """ALSA's configuration file: the card's devices by name, at exactly this rate and channel count."""
    return _DEVICES.format(
        socket=socket, rate=rate, channels=channels, speaker=SPEAKER, microphone=MICROPHONE
    )


def ports(channels: int) -> tuple[list[str], list[str]]:
    """What the sink plays, and where the microphone hears it, channel by channel."""
    positions = _POSITIONS[channels]
    return [f"{SPEAKER}:monitor_{each}" for each in positions], [
        f"{MICROPHONE}:input_{each}" for each in positions
    ]
