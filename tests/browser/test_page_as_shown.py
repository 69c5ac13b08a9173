"""The page of a report in two browsers: it asks for nothing and complains of nothing."""

import pytest


@pytest.fixture
def shown(tab, report_of):
    tab.open(report_of("slide") / "index.html")
    return tab


def test_the_page_asks_for_nothing_and_nothing_is_complained_of(shown):
    shown.evaluate("new Promise(done => setTimeout(done, 50))")
    assert not shown.requests and not shown.errors


def test_every_link_of_the_page_leads_to_something_on_it(shown):
    assert not shown.evaluate(
        "[...document.querySelectorAll('a[href^=\"#\"]')].map(a => a.getAttribute('href').slice(1))"
        ".filter(id => !document.getElementById(id))"
    )


def test_the_policy_lets_no_other_script_run(shown):
    shown.run(
        "const other = document.createElement('script');"
        "other.textContent = 'window.ran = true'; document.body.append(other);"
    )
    assert shown.evaluate("window.ran === undefined")
