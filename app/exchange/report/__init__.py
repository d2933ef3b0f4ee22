"""The printable report on a plan: one page of HTML with its verdict, figures and pictures. Not for clinical use."""

from __future__ import annotations

from app.exchange.report.report import PlanReports

__all__ = ["PlanReports"]
