"""A page in the browser, as a reader opens it from a file."""

from contextlib import contextmanager


@contextmanager
def open_page(browser, path, **context):
    """The page of a file; `asked` lists what it fetches, `wrong` its errors and messages."""
    own = browser.new_context(**context)
    page = own.new_page()
    page.set_default_timeout(60_000)
    page.asked, page.wrong = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("console", lambda message: page.wrong.append(message.text))
    page.goto(f"file://{path}")
    try:
        yield page
    finally:
        own.close()
