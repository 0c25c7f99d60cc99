"""The timeline of the page: a strip of frames, and above it, opened, bars of contacts, keys and curves."""

from __future__ import annotations

from typing import Any

_SVG = (  # of numbers alone
    "`<svg viewBox='0 0 100 100' preserveAspectRatio='none'>"
    "<line x1='0' x2='100' class='limit' y1='${curve.limit}' y2='${curve.limit}'/>"
    "<path class='${curve.above ? 'over' : ''}' d='${curve.path}'/></svg>`"
)


def timeline(v3: Any, html: Any, button: Any) -> None:
    """The strip at the bottom and what opens above it."""
    with html.Div(classes=("'contact-film' + (film_open ? ' open' : '')",)):
        with html.Div(v_if=("film_open",), classes=("'film-body contact-scroll' + (film.measured ? '' : ' old')",)):
            _curves(html)
            _bars(html)
            _keys(html)
            html.Div(
                "Pairs with spans have bars here; drag a bar, its ends, or a key. Click a curve to go there.",
                v_if=("!film.bars.length && !film.lanes.length",), classes="film-empty",
            )  # fmt: skip
        _strip(v3, html, button)


def _curves(html: Any) -> None:
    with html.Div(v_for="curve in film.curves", key=("curve.name",), classes="film-row curve",
                  title=("curve.limit_words",)):  # fmt: skip
        with html.Div(
            classes="film-name", style="cursor: pointer;",
            click="curve.worst !== null && trigger('show_worst', [curve.worst, curve.pair])",
            title=("'go to the worst: ' + curve.words",),
        ):  # fmt: skip
            html.Span("{{ curve.name }}")
            html.Span("{{ curve.words }}", classes=("'figure level' + (curve.above ? 2 : 0)",))
        with html.Div(classes="film-lane", raw_attrs=['data-film-go="1"']):
            html.Div(v_html=(_SVG,))
            _playhead(html)


def _bars(html: Any) -> None:
    with html.Div(v_for="bar in film.bars", key=("bar.key",), classes="film-row"):
        with html.Div(classes="film-name", click="trigger('choose_pair', [bar.pair])", style="cursor: pointer;"):
            html.Span(classes="contact-mark", style=("'background: ' + bar.color",))
            html.Span("{{ bar.pair }}", classes="text-truncate")
        with html.Div(classes="film-lane bars", raw_attrs=['data-film-go="1"']):
            with html.Div(
                classes=("'film-bar' + (bar.fixed ? ' fixed' : '')",), title=("bar.words",),
                style=("'left: ' + bar.left + '%; width: ' + bar.width + '%'",),
            ):  # fmt: skip
                html.Div(classes="ramp in", style=("'width: ' + bar.in + '%; background: ' + bar.color",))
                html.Div(
                    classes="held",
                    style=("'left: ' + bar.in + '%; right: ' + bar.out + '%; background: ' + bar.tint",),
                )
                html.Div(classes="ramp out", style=("'width: ' + bar.out + '%; background: ' + bar.color",))
                for part, where in (
                    ("all", "left: 0; right: 0"),
                    ("ease_in", "left: -4px; width: 8px"),
                    ("ease_out", "right: -4px; width: 8px"),
                ):
                    _grip(html, part, f"'{where}'")
                _grip(html, "on", "'width: 8px; left: calc(' + bar.in + '% - 4px)'")
                _grip(html, "off", "'width: 8px; right: calc(' + bar.out + '% - 4px)'")
            _playhead(html)


def _grip(html: Any, part: str, style: str) -> None:
    html.Div(
        v_if=("!bar.fixed",), classes=f"grip {part}", style=(style,),
        raw_attrs=[
            'data-film-drag="span"', f'data-part="{part}"', ':data-name="bar.pair"', ':data-frame="bar.middle"'
        ],
    )  # fmt: skip


def _keys(html: Any) -> None:
    with html.Div(v_for="lane in film.lanes", key=("lane.track",), classes="film-row keys"):
        with html.Div(classes="film-name"):
            html.Span("{{ lane.words }}", classes="text-truncate", style="opacity: .75;")
        with html.Div(classes="film-lane", raw_attrs=['data-film-go="1"']):
            html.Span(
                v_for="key in lane.keys", key=("key.frame",), classes=("'film-key ' + key.kind",),
                style=("'left: ' + key.at + '%'",), title=("key.words",),
                raw_attrs=[
                    'data-film-drag="key"', 'data-part="key"', ':data-name="lane.track"', ':data-frame="key.frame"'
                ],
            )  # fmt: skip
            _playhead(html)


def _playhead(html: Any) -> None:
    html.Div(classes="playhead", style=("'left: ' + film.at + '%'",))


def _strip(v3: Any, html: Any, button: Any) -> None:
    with html.Div(classes="contact-strip"):
        button(v3, "mdi-chart-timeline", "Timeline: contacts, keys and curves", click="film_open = !film_open")
        button(v3, "mdi-skip-previous", "The key before (Left)", click="trigger('act', ['pose.previous'])")
        with v3.VBtn(
            icon=True, size="small", density="comfortable", click="trigger('act', ['film.play'])",
            title="Play or stop (Shift+Right)", color=("film.playing ? 'primary' : undefined",),
        ):  # fmt: skip
            v3.VIcon("{{ film.playing ? 'mdi-stop' : 'mdi-play' }}", size="20")
        button(v3, "mdi-skip-next", "The next key (Right)", click="trigger('act', ['pose.next'])")
        with v3.VBtn(icon=True, size="small", density="comfortable", click="trigger('film_loop', [!film.loop])",
                     title="Over and over", color=("film.loop ? 'primary' : undefined",)):  # fmt: skip
            v3.VIcon("mdi-repeat", size="20")
        with v3.VBtn(icon=True, size="small", density="comfortable", click="trigger('act', ['film.onion'])",
                     title="Onion skin (O)", color=("film.onion ? 'primary' : undefined",)):  # fmt: skip
            v3.VIcon("mdi-layers-triple-outline", size="20")
        button(v3, "mdi-auto-fix", "Solve the film (Ctrl+Shift+Space)", click="trigger('act', ['film.solve'])")
        button(v3, "mdi-key-plus", "Key the pose (A)", click="trigger('act', ['pose.key'])")
        with html.Div(classes="track"):
            with html.Div(v_for="lane in film.lanes", key=("lane.track",)):
                html.Span(
                    v_for="key in lane.keys", key=("key.frame",), v_show=("lane.kind === 'pose'",),
                    classes="mark", style=("'left: ' + key.at + '%'",),
                    title=("'key at frame ' + key.frame",), click="trigger('go_to', [key.frame])",
                )  # fmt: skip
            html.Input(
                type="range", min=("film.first",), max=("film.last",), step="1", value=("film.frame",),
                input="trigger('go_to', [Number($event.target.value)])", title="Frame",
            )  # fmt: skip
        html.Span("{{ film.frame }}", classes="frame")
        html.Span("of", style="opacity: .6; padding: 0 4px;")
        html.Input(type="number", value=("film.last",), title="The last frame of the film", classes="last",
                   change="trigger('film_end', [Number($event.target.value)])")  # fmt: skip
