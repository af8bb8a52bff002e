"""Pages of the program within a notebook."""

from html import escape


def framed(page: str, height: int) -> str:
    """A page as an element of its own, so that its style and scripts stay in it."""
    return (
        f'<iframe srcdoc="{escape(page)}" sandbox="allow-scripts" '
        f'style="width: 100%; height: {height}px; border: 0"></iframe>'
    )
