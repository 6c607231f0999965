"""A study's page as a reader opens it."""

from opened_pages import open_page
from palpate_studies.run_study import Work
from palpate_studies.summary import present
from studies.small import Formula, planned, text


def test_curves_of_a_study_are_read_with_their_range_and_zoomed_together(browser, tmp_path):
    source = text(
        '"controller.ki" = { log = [1.0, 100.0], points = 9 }\n"surface.damping" = [60.0, 200.0]\n'
        '"surface.stiffness" = [1000.0, 5000.0]',
        head="seeds = 2",
        tail='[[curves]]\nx = "controller.ki"\nmetric = "force_rms"\npanels = "surface.stiffness"',
    )
    study, runner = planned(source), Formula(lambda at: at["controller.ki"] + at["surface.damping"])
    frame = Work(study, source, tmp_path, runner).run(replace=False)
    present(frame, study, tmp_path, source, "palpate study T")
    with open_page(browser, tmp_path / "report.html", viewport={"width": 1400, "height": 900}) as page:
        plots = page.locator(".panel .plot")
        assert plots.count() == 2
        plots.first.scroll_into_view_if_needed()
        box = plots.first.locator(".u-over").bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 60)  # the middle of 1 to 100 by the logarithm
        told = page.locator(".panel .read").all_text_contents()
        assert told[0] == told[1]
        assert told[0].startswith("10.000")
        assert told[0].endswith("140.0 (70.00 to 210.0)")
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] - 10, box["y"] + 60, steps=4)
        page.mouse.up()
        assert page.locator(".panel.zoomed").count() == 2
        assert page.wrong == []
